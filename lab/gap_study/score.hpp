// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lab/program/share.hpp"

// What `loopwarden gap` answered, held against the truth.
namespace loopwarden::studies::gap_study {

enum class Kind { kSingle, kNone, kPair, kOutside };

struct Truth {
  std::string id;
  std::string effect;
  std::vector<std::string> accept;
  std::map<std::string, double> parameters;
  std::string note;
  double floor_rmse = 0.0;
};

struct NamedEffect {
  std::string name;
  double confidence = 0.0;
  // Numbers only; curves are left out.
  std::map<std::string, double> parameters;
  // By which the explanation leads over the best without this name; NaN for a controller's settings.
  double lead_nats = std::nan("");
  std::vector<std::string> alternatives{};
};

// What the chosen explanation leaves, as gap.json has it under gap.rest.
struct Rest {
  bool is_noise = true;
  double noise_ratio = std::nan("");
  double kurtosis = std::nan("");
  double answer_to_co = std::nan("");
  double closed = std::nan("");
};

struct Answer {
  // Why there is none: exit code, time limit, unreadable gap.json. Empty for an answer.
  std::string failure;
  std::string verdict;
  std::vector<NamedEffect> effects;
  // RMSE over the holdout, PV units.
  std::optional<double> before;
  std::optional<double> after;
  // (name, RMSE) in the order of gap.json.
  std::vector<std::pair<std::string, double>> candidates;
  Rest rest;
  // Not of an answer that was there already.
  std::optional<double> seconds;
};

// truth.json. Throws std::runtime_error that says what is wrong.
std::vector<Truth> parse_truth(std::string_view text);
// gap.json. Throws std::runtime_error that says what is wrong.
Answer parse_answer(std::string_view text);

Kind kind_of(const Truth& truth);

struct CaseScore {
  Kind kind = Kind::kSingle;
  // Single: one name, an accepted one. Pair: both names and no other; where hysteresis is hidden,
  // backlash stands for it. None: no name. Outside: verdict `unexplained`.
  bool right = false;
  // Outside: only where before > 1.5 floor; an answer that failed counts.
  bool counts = true;
  // (before^2 - after^2) / (before^2 - floor^2) over the holdout; only single and pair with
  // before > 2 floor and the gap not in the controller.
  std::optional<double> closed;
  // |found - true| / |true| of each parameter of the right names that truth and answer share.
  std::vector<double> parameter_errors;
  // (confidence, is it a right name) of each name given.
  std::vector<std::pair<double, bool>> names;
};
CaseScore score_case(const Truth& truth, const Answer& answer);

struct Summary {
  std::size_t cases = 0;
  std::size_t failures = 0;
  Share single_right;
  Share none_named;
  Share pair_right;
  Share confident_right;
  Share right_confident;
  Share outside_unexplained;
  std::vector<double> closed;
  std::vector<double> parameter_errors;
  std::vector<double> seconds;
  // Truth -> what was answered -> how often.
  std::map<std::string, std::map<std::string, std::size_t>> confusion;
};

struct ScoredCase {
  Truth truth;
  Answer answer;
  CaseScore score;
};
Summary summarise(const std::vector<ScoredCase>& cases);

// "no_gap", "unexplained", "stiction+gain_change", "failed".
std::string label_of(const Answer& answer);

// Linear between the order statistics; `part` from 0 to 1. Throws std::invalid_argument if empty.
double quantile(std::vector<double> values, double part);

}  // namespace loopwarden::studies::gap_study
