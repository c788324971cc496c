// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "config/specialists/weights_text.hpp"

namespace loopwarden::config {
namespace {

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string layers_of(const specialist::Network& network) {
  const specialist::NetworkShape s = network.shape();
  return fmt::format("{}-{}-{}-{}", s.inputs, s.first_hidden, s.second_hidden, s.outputs);
}

class Writer {
 public:
  explicit Writer(const std::filesystem::path& folder) : folder_(folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) failure_ = fmt::format("{}: {}", folder.string(), error.message());
  }

  // Sets failure() if the disk refuses.
  void write(const std::string& name, const std::string& text) {
    if (!failure_.empty()) return;
    const auto error = base::replace_file(folder_ / name, text, {.mode = 0666});
    if (error) failure_ = error->text();
  }

  const std::string& failure() const noexcept { return failure_; }

 private:
  std::filesystem::path folder_;
  std::string failure_;
};

// Writes the weights. Returns the lines about them for the manifest.
std::string write_weights(const std::filesystem::path& folder, const SpecialistFileSink& write,
                          const std::string& name, const specialist::Network& network,
                          const std::vector<double>& target) {
  constexpr std::size_t kDigits = 12;
  const std::string text = weights_text(network, target);
  const std::string digest = base::sha256_hex(text);
  std::string file = name + ".weights";
  const std::optional<std::string> there = base::read_file(folder / file);
  if (there && *there != text) {
    file = fmt::format("{}-{}.weights", name, digest.substr(0, kDigits));
  }
  write(file, text);
  return fmt::format("    layers: {}\n    file: {}\n    sha256: {}\n", layers_of(network), file,
                     digest);
}

std::string loop_text(const specialist::Team& team) {
  const specialist::LoopFacts& f = team.facts;
  std::string text = fmt::format(
      "loop:\n  sample_time: {}        # s\n  gain: {}               # PV units/CO unit\n"
      "  time_constant: {}      # s\n  dead_time: {}          # s\n  output: [{}, {}]\n"
      "  range: [{}, {}]\ntemperature: {}\nevidence:  # centre and scale\n",
      f.period_s, f.gain, f.time_constant_s, f.dead_time_s, f.co_low, f.co_high, f.pv_low,
      f.pv_high, team.temperature);
  for (std::size_t i = 0; i < specialist::kNetworkInputs; ++i) {
    text += fmt::format("  - [{}, {}]  # {}\n", static_cast<float>(team.centre[i]),
                        static_cast<float>(team.scale[i]), specialist::input_name(i));
  }
  return text;
}

}  // namespace

std::vector<std::string> weight_files(const std::filesystem::path& folder) {
  constexpr std::string_view kKey = "    file: ";
  std::vector<std::string> files;
  std::istringstream lines(base::read_file(folder / "manifest.yaml").value_or(""));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kKey)) files.push_back(line.substr(kKey.size()));
  }
  return files;
}

void remove_weights(const std::filesystem::path& folder, const std::vector<std::string>& earlier) {
  const std::vector<std::string> now = weight_files(folder);
  for (const std::string& file : earlier) {
    std::error_code ignored;
    if (std::find(now.begin(), now.end(), file) != now.end()) continue;
    std::filesystem::remove(folder / std::filesystem::path(file).filename(), ignored);
  }
}

void write_specialists(const SpecialistFolder& s, const std::filesystem::path& folder,
                       const SpecialistFileSink& write) {
  std::string text = fmt::format(
      "# Written by loopwarden train.\nformat: loopwarden-specialists\nversion: {}\nplant: {}\n"
      "training:\n  source: {}\n  seed: {}\n  windows: {}\n  signatures: {}\n",
      kSpecialistVersion, in_quotes(s.plant), in_quotes(s.training.source), s.training.seed,
      s.training.windows, s.training.signatures);
  if (s.figures) {
    text += fmt::format(
        "figures:  # on simulated windows never seen in training\n  windows: {}\n"
        "  named_percent: {:.2f}\n  false_alarm_percent: {:.2f}\n  undecided_percent: {:.2f}\n"
        "  calibration_error: {:.4f}\n",
        s.figures->windows, s.figures->named_percent, s.figures->false_alarm_percent,
        s.figures->undecided_percent, s.figures->calibration_error);
  }
  if (s.team) text += loop_text(*s.team);
  text += "specialists:\n";
  if (s.team) {
    for (const specialist::TeamMember& m : s.team->members) {
      text += fmt::format("  - name: {}\n    form: explaining\n    class: {}\n", m.name,
                          to_text(m.condition));
      text += write_weights(folder, write, m.name, m.network, {});
      text += fmt::format("    most_misfit: {}  # log of the mean square over the noise\n",
                          static_cast<float>(m.most_misfit));
    }
  }
  for (const specialist::SignatureSpecialist& m : s.signatures) {
    text += fmt::format("  - name: {}\n    form: signature\n    class: {}\n    scaling: [{}, {}]\n",
                        m.name, to_text(m.condition), m.scaling.centre - m.scaling.half_span,
                        m.scaling.centre + m.scaling.half_span);
    text += write_weights(folder, write, m.name, m.network, m.target);
  }
  write("manifest.yaml", text);
}

std::string write_specialists(const SpecialistFolder& s, const std::filesystem::path& folder) {
  const std::vector<std::string> earlier = weight_files(folder);
  Writer writer(folder);
  write_specialists(s, folder, [&writer](const std::string& name, const std::string& text) {
    writer.write(name, text);
  });
  if (writer.failure().empty()) remove_weights(folder, earlier);
  return writer.failure();
}

}  // namespace loopwarden::config
