// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace loopwarden::lab::gap_study {
namespace {

constexpr std::string_view kHeader =
    "case,truth,name,right,lead_nats,rest_is_noise,noise_ratio,kurtosis,answer_to_co,closed";
constexpr std::string_view kController = "controller_mismatch";

std::string number_text(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string();
}

double number_of(std::string_view cell) {
  if (cell.empty()) return std::nan("");
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) {
    throw std::runtime_error(fmt::format("'{}' is no number", cell));
  }
  return value;
}

bool truth_of(std::string_view cell) {
  if (cell != "0" && cell != "1") throw std::runtime_error(fmt::format("'{}' is not 0 or 1", cell));
  return cell == "1";
}

std::vector<std::string_view> parts_of(std::string_view line, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = line.find(separator);
    parts.push_back(line.substr(0, end));
    if (end == std::string_view::npos) return parts;
    line.remove_prefix(end + 1);
  }
}

GivenName parse_name(std::string_view line) {
  const std::vector<std::string_view> cells = parts_of(line, ',');
  if (cells.size() != parts_of(kHeader, ',').size()) {
    throw std::runtime_error(fmt::format("{} cells, expected {}", cells.size(), kHeader));
  }
  return {std::string(cells[0]),
          std::string(cells[1]),
          std::string(cells[2]),
          truth_of(cells[3]),
          number_of(cells[4]),
          {truth_of(cells[5]), number_of(cells[6]), number_of(cells[7]), number_of(cells[8]),
           number_of(cells[9])}};
}

// Groups the names in the order of their leads and joins groups until their shares rise.
std::vector<Group> rising(std::vector<std::pair<double, bool>> names) {
  std::sort(names.begin(), names.end());
  std::vector<Group> groups;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& [lead, right] = names[i];
    const bool tied = i > 0 && lead == names[i - 1].first;
    const bool enough_left = names.size() - i >= kLeastGroup;
    if (groups.empty() || (groups.back().names >= kLeastGroup && enough_left && !tied)) {
      groups.push_back({groups.empty() ? 0.0 : lead, 0, 0});
    }
    ++groups.back().names;
    groups.back().right += right ? 1 : 0;
  }
  for (std::size_t i = 1; i < groups.size();) {
    if (groups[i].share() > groups[i - 1].share()) {
      ++i;
      continue;
    }
    groups[i - 1].names += groups[i].names;
    groups[i - 1].right += groups[i].right;
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(i));
    if (i > 1) --i;
  }
  if (groups.empty()) groups.push_back({});  // without data: one half
  return groups;
}

std::string rows_source(const std::vector<Group>& groups) {
  std::string text;
  for (const Group& group : groups) {
    text += fmt::format("    ConfidenceRow{{{:.6g}, {}, {}}},\n", group.from_nats, group.names,
                        group.right);
  }
  return text;
}

// Returns the limits of the values in rest cases whose name was correct.
std::string limits_text(const std::vector<GivenName>& names) {
  const auto most = [&](double Rest::*value) {
    std::vector<double> values;
    for (const GivenName& one : names) {
      if (one.right && std::isfinite(one.rest.*value)) values.push_back(one.rest.*value);
    }
    return values.empty() ? std::nan("") : quantile(values, 0.9);
  };
  return fmt::format(
      "// Nine in ten correct names have a remaining error with noise ratio up to {:.3g}, "
      "kurtosis up to {:.3g},\n// answer to CO up to {:.3g}.\n",
      most(&Rest::noise_ratio), most(&Rest::kurtosis), most(&Rest::answer_to_co));
}

}  // namespace

std::vector<GivenName> names_given(const std::vector<ScoredCase>& cases) {
  std::vector<GivenName> names;
  for (const ScoredCase& one : cases) {
    for (std::size_t i = 0; i < one.answer.effects.size(); ++i) {
      const NamedEffect& effect = one.answer.effects[i];
      names.push_back({one.truth.id, one.truth.effect, effect.name, one.score.names[i].second,
                       effect.lead_nats, one.answer.rest});
    }
  }
  return names;
}

std::string names_csv(const std::vector<std::string>& made_by,
                      const std::vector<GivenName>& names) {
  std::string text;
  for (const std::string& line : made_by) text += "# " + line + "\n";
  text += std::string(kHeader) + "\n";
  for (const GivenName& one : names) {
    text += fmt::format("{},{},{},{:d},{},{:d},{},{},{},{}\n", one.id, one.truth, one.name,
                        one.right, number_text(one.lead_nats), one.rest.is_noise,
                        number_text(one.rest.noise_ratio), number_text(one.rest.kurtosis),
                        number_text(one.rest.answer_to_co), number_text(one.rest.closed));
  }
  return text;
}

NamesFile parse_names(std::string_view text) {
  NamesFile file;
  bool header = false;
  std::size_t number = 0;
  for (const std::string_view line : parts_of(text, '\n')) {
    ++number;
    try {
      if (line.empty()) continue;
      if (line.substr(0, 2) == "# ") {
        file.made_by.emplace_back(line.substr(2));
      } else if (!header) {
        if (line != kHeader) throw std::runtime_error(fmt::format("the header is not {}", kHeader));
        header = true;
      } else {
        file.names.push_back(parse_name(line));
      }
    } catch (const std::runtime_error& e) {
      throw std::runtime_error(fmt::format("line {}: {}", number, e.what()));
    }
  }
  if (!header) throw std::runtime_error(fmt::format("no header {}", kHeader));
  return file;
}

Calibration calibrate(const std::vector<GivenName>& names) {
  std::vector<std::pair<double, bool>> noise;
  std::vector<std::pair<double, bool>> more;
  Calibration calibration;
  for (const GivenName& one : names) {
    if (one.name == kController) {
      ++calibration.controller.names;
      calibration.controller.right += one.right ? 1 : 0;
    } else {
      (one.rest.is_noise ? noise : more).emplace_back(std::max(one.lead_nats, 0.0), one.right);
    }
  }
  calibration.rest_is_noise = rising(std::move(noise));
  calibration.rest_is_more = rising(std::move(more));
  return calibration;
}

std::string table_source(const NamesFile& file) {
  const Calibration c = calibrate(file.names);
  std::string text =
      "// SPDX-License-Identifier: Apache-2.0\n"
      "// Written by loopwarden-study gap --calibrate; manual changes are lost. Command:\n";
  for (const std::string& line : file.made_by) text += "//   " + line + "\n";
  text += limits_text(file.names);
  text +=
      "// clang-format off\n"
      "#include <array>\n\n"
      "#include \"model/gap/confidence.hpp\"\n\n"
      "namespace loopwarden::gap {\n"
      "namespace {\n\n"
      "// nats from, names given, of these right\n"
      "constexpr std::array kRestIsNoise{\n" +
      rows_source(c.rest_is_noise) +
      "};\n"
      "constexpr std::array kRestIsMore{\n" +
      rows_source(c.rest_is_more) +
      "};\n\n"
      "}  // namespace\n\n" +
      fmt::format(
          "const ConfidenceTable kConfidenceTable{{kRestIsNoise, kRestIsMore, {{0, {}, {}}}}};\n\n",
          c.controller.names, c.controller.right) +
      "}  // namespace loopwarden::gap\n";
  return text;
}

std::string calibration_text(const Calibration& c) {
  std::string text;
  const auto add = [&](const char* what, const std::vector<Group>& groups) {
    for (const Group& group : groups) {
      text += fmt::format("{:<32} from {:8.4g} nats: {:>4} of {:>4} right, confidence {:.3f}\n",
                          what, group.from_nats, group.right, group.names, group.share());
    }
  };
  add("effect, the rest is noise", c.rest_is_noise);
  add("effect, the rest is more", c.rest_is_more);
  add("controller_mismatch", {c.controller});
  return text;
}

}  // namespace loopwarden::lab::gap_study
