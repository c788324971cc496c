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

// Compares the answers of `loopwarden gap` with the truth.
namespace loopwarden::lab::gap_study {

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
};

struct Answer {
  // Reason of a missing answer: exit code, time limit, unreadable gap.json. Empty for an answer.
  std::string failure;
  std::string verdict;
  std::vector<NamedEffect> effects;
  // RMSE over the holdout, PV units.
  std::optional<double> before;
  std::optional<double> after;
  // (name, RMSE) in the order of gap.json.
  std::vector<std::pair<std::string, double>> candidates;
  // Not set for an answer of an earlier run.
  std::optional<double> seconds;
};

// Parses truth.json. Throws std::runtime_error with the reason.
std::vector<Truth> parse_truth(std::string_view text);
// Parses gap.json. Throws std::runtime_error with the reason.
Answer parse_answer(std::string_view text);

Kind kind_of(const Truth& truth);

struct CaseScore {
  Kind kind = Kind::kSingle;
  // Single: one name, which is accepted. Pair: both names and no other; backlash is accepted for a
  // hidden hysteresis. None: no name. Outside: verdict `unexplained`.
  bool right = false;
  // Outside: counts only if before > 1.5 floor; a failed answer counts.
  bool counts = true;
  // (before^2 - after^2) / (before^2 - floor^2) over the holdout; only single and pair with
  // before > 2 floor and the gap not in the controller.
  std::optional<double> closed;
  // found - true| / |true| of each parameter that truth and answer share, for correct names.
  std::vector<double> parameter_errors;
  // (confidence, is it correct) of each given name.
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
  // Truth -> answer -> number of cases.
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

// Interpolates linearly between the order statistics; `part` from 0 to 1. Throws
// std::invalid_argument if empty.
double quantile(std::vector<double> values, double part);

}  // namespace loopwarden::lab::gap_study
