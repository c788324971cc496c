// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

namespace loopwarden::lab::gap_study {
namespace {

using nlohmann::json;

constexpr double kConfident = 0.9;

std::map<std::string, double> numbers_in(const json& object) {
  std::map<std::string, double> numbers;
  for (const auto& [key, value] : object.items()) {
    if (value.is_number()) numbers[key] = value.get<double>();
  }
  return numbers;
}

std::optional<double> number_at(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Returns the hidden effect that a name matches; empty if it matches none of them.
std::string hidden_effect_of(const std::string& name, const Truth& truth) {
  const Kind kind = kind_of(truth);
  if (kind == Kind::kNone) return {};
  if (kind == Kind::kSingle || kind == Kind::kOutside)
    return contains(truth.accept, name) ? truth.effect : std::string{};
  if (contains(truth.accept, name)) return name;
  const bool for_hysteresis = name == "backlash" && contains(truth.accept, "hysteresis");
  return for_hysteresis ? "hysteresis" : std::string{};
}

bool is_right(const Truth& truth, const Answer& answer) {
  if (!answer.failure.empty()) return false;
  switch (kind_of(truth)) {
    case Kind::kNone: return answer.effects.empty() && answer.verdict != "missing_effect";
    case Kind::kOutside:
      if (answer.effects.empty()) return answer.verdict == "unexplained";
      break;
    case Kind::kSingle:
    case Kind::kPair: break;
  }
  std::set<std::string> found;
  for (const NamedEffect& effect : answer.effects) {
    const std::string hidden = hidden_effect_of(effect.name, truth);
    if (hidden.empty() || !found.insert(hidden).second) return false;
  }
  const std::size_t wanted = kind_of(truth) == Kind::kPair ? truth.accept.size() : 1;
  return answer.verdict == "missing_effect" && found.size() == wanted;
}

bool gap_in_controller(const Truth& truth) { return contains(truth.accept, "controller_mismatch"); }

std::optional<double> closed_share(const Truth& truth, const Answer& answer) {
  const Kind kind = kind_of(truth);
  if (kind == Kind::kNone || kind == Kind::kOutside || gap_in_controller(truth)) {
    return std::nullopt;
  }
  if (!answer.before || !answer.after || *answer.before <= 2.0 * truth.floor_rmse) {
    return std::nullopt;
  }
  const double before = *answer.before * *answer.before;
  return (before - *answer.after * *answer.after) / (before - truth.floor_rmse * truth.floor_rmse);
}

// Returns the name of a true parameter under another accepted effect name.
std::string name_of_parameter(const std::string& parameter, const std::string& effect) {
  return effect == "backlash" && parameter == "width" ? "deadband" : parameter;
}

void collect_parameter_errors(const Truth& truth, const Answer& answer, CaseScore& score) {
  for (const auto& [parameter, value] : truth.parameters) {
    for (const NamedEffect& effect : answer.effects) {
      const auto found = effect.parameters.find(name_of_parameter(parameter, effect.name));
      if (found == effect.parameters.end() || value == 0.0) continue;
      score.parameter_errors.push_back(std::abs(found->second - value) / std::abs(value));
    }
  }
}

void count_names(const ScoredCase& one, Summary& summary) {
  for (const auto& [confidence, right] : one.score.names) {
    if (confidence >= kConfident) summary.confident_right.count(right);
    if (right) summary.right_confident.count(confidence >= kConfident);
  }
}

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

std::vector<Truth> parse_truth(std::string_view text) {
  std::vector<Truth> all;
  try {
    for (const json& entry : json::parse(text)) {
      Truth truth;
      truth.id = entry.at("id").get<std::string>();
      truth.effect = entry.at("effect").get<std::string>();
      truth.accept = entry.at("accept").get<std::vector<std::string>>();
      truth.parameters = numbers_in(entry.at("par"));
      truth.note = entry.value("note", "");
      truth.floor_rmse = entry.at("floor_rmse").get<double>();
      all.push_back(std::move(truth));
    }
  } catch (const json::exception& e) {
    throw std::runtime_error(fmt::format("truth.json: {}", e.what()));
  }
  return all;
}

Answer parse_answer(std::string_view text) {
  Answer answer;
  try {
    const json root = json::parse(text);
    answer.verdict = root.at("verdict").get<std::string>();
    for (const json& entry : root.at("effects")) {
      answer.effects.push_back({entry.at("name").get<std::string>(),
                                entry.at("confidence").get<double>(),
                                numbers_in(entry.at("parameters"))});
    }
    const json& gap = root.at("gap");
    answer.before = number_at(gap.at("before"), "holdout_rmse");
    answer.after = number_at(gap.at("after"), "holdout_rmse");
    for (const json& entry : root.value("candidates", json::array())) {
      answer.candidates.emplace_back(entry.at("name").get<std::string>(),
                                     number_at(entry, "rmse").value_or(std::nan("")));
    }
  } catch (const json::exception& e) {
    throw std::runtime_error(fmt::format("gap.json: {}", e.what()));
  }
  return answer;
}

Kind kind_of(const Truth& truth) {
  if (truth.effect == "none") return Kind::kNone;
  if (truth.effect.rfind("outside:", 0) == 0) return Kind::kOutside;
  return truth.effect.find('+') == std::string::npos ? Kind::kSingle : Kind::kPair;
}

CaseScore score_case(const Truth& truth, const Answer& answer) {
  CaseScore score;
  score.kind = kind_of(truth);
  score.right = is_right(truth, answer);
  if (score.kind == Kind::kOutside && answer.failure.empty()) {
    score.counts = answer.before && *answer.before > 1.5 * truth.floor_rmse;
  }
  score.closed = closed_share(truth, answer);
  for (const NamedEffect& effect : answer.effects) {
    score.names.emplace_back(effect.confidence, !hidden_effect_of(effect.name, truth).empty());
  }
  const bool names_hidden = score.kind == Kind::kSingle || score.kind == Kind::kPair;
  if (score.right && names_hidden) collect_parameter_errors(truth, answer, score);
  return score;
}

Summary summarise(const std::vector<ScoredCase>& cases) {
  Summary summary;
  for (const ScoredCase& one : cases) {
    ++summary.cases;
    if (!one.answer.failure.empty()) ++summary.failures;
    switch (one.score.kind) {
      case Kind::kSingle: summary.single_right.count(one.score.right); break;
      case Kind::kNone:
        summary.none_named.count(!one.score.right && one.answer.failure.empty());
        break;
      case Kind::kPair: summary.pair_right.count(one.score.right); break;
      case Kind::kOutside:
        if (one.score.counts) summary.outside_unexplained.count(one.score.right);
        break;
    }
    count_names(one, summary);
    if (one.score.closed) summary.closed.push_back(*one.score.closed);
    append(summary.parameter_errors, one.score.parameter_errors);
    if (one.answer.seconds) summary.seconds.push_back(*one.answer.seconds);
    ++summary.confusion[one.truth.effect][label_of(one.answer)];
  }
  return summary;
}

std::string label_of(const Answer& answer) {
  if (!answer.failure.empty()) return "failed";
  if (answer.effects.empty()) return answer.verdict;
  std::string label;
  for (const NamedEffect& effect : answer.effects) {
    label += (label.empty() ? "" : "+") + effect.name;
  }
  return label;
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) throw std::invalid_argument("no values to take a quantile of");
  std::sort(values.begin(), values.end());
  const double place = part * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  const double share = place - static_cast<double>(below);
  return (1.0 - share) * values[below] + share * values[above];
}

}  // namespace loopwarden::lab::gap_study
