// SPDX-License-Identifier: Apache-2.0
// Tuning rules tried on a loop model: what each gives, its margins (loop_frequency.hpp) and its answer to a step of the set point
// and of the load (loop_trial.hpp). They are watched long enough for the slowest rule: 15 (2 (T + T2) + L) each, an
// integrating process 100 (T2 + L).
//
// Limits: valve effects are left out, so is what a limit of CO does to a step of another size.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/analysis/loop_frequency.hpp"
#include "model/analysis/loop_trial.hpp"
#include "model/analysis/tuning_rules.hpp"

namespace loopwarden::analysis {

// Robust in the sense of Åström and Hägglund (2006), section 4.6: 1.2 to 2.
inline constexpr double kMostSensitivity = 2.0;

struct RuleTrial {
  std::optional<TuningRule> rule;  // nothing: the model's own gains, as they are
  control::PidGains gains;
  Margins margins{};
  PredictedResponse response{};

  std::string name() const { return rule ? to_text(*rule) : "as it is"; }
  bool scales() const noexcept { return !rule || scales_with_gain(*rule); }
};

// s, of each of the two steps.
double watched_s(const plant::ProcessParameters& process) noexcept;

// The model's own gains first, then each rule that has such a form. `filter_s`: of the derivative, where the loop has one that
// a rule can't change.
std::vector<RuleTrial> try_rules(const plant::LoopModel& model, const TuningOptions& options = {},
                                 std::optional<double> filter_s = {});

// Of the rules that scale with the gain and leave enough margin, the one that meets a load best; null: none leaves it.
const RuleTrial* recommended(const std::vector<RuleTrial>& trials) noexcept;

}  // namespace loopwarden::analysis
