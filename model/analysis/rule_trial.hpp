// SPDX-License-Identifier: Apache-2.0
// Tries tuning rules on a loop model: gains, margins (loop_frequency.hpp), and the responses to a
// set-point step and to a disturbance step (loop_trial.hpp). Each run is long enough for the
// slowest rule: 15 (2 (T + T2) + L), for an integrating process 100 (T2 + L).
//
// Limits: valve effects are left out, and so is the effect of limits of CO on steps of other sizes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/analysis/loop_frequency.hpp"
#include "model/analysis/loop_trial.hpp"
#include "model/analysis/tuning_rules.hpp"

namespace loopwarden::analysis {

struct RuleTrial {
  std::optional<TuningRule> rule;  // empty: the gains of the model
  control::PidGains gains;
  Margins margins{};
  PredictedResponse response{};

  std::string name() const { return rule ? to_text(*rule) : "as it is"; }
  bool scales() const noexcept { return !rule || scales_with_gain(*rule); }
};

// Returns the duration of the run after each of the two steps, s.
double watched_s(const plant::ProcessParameters& process) noexcept;

// Returns the trial of the model's gains, followed by one trial per rule that has the form of
// `options`. `filter_s`: time constant of the derivative filter, s, if the loop has a filter that a
// rule can't change.
std::vector<RuleTrial> try_rules(const plant::LoopModel& model, const TuningOptions& options = {},
                                 std::optional<double> filter_s = {});

// Returns the rule with the best response to a disturbance among those that scale with the gain and
// leave enough margin; null if no rule leaves enough margin.
const RuleTrial* recommended(const std::vector<RuleTrial>& trials) noexcept;

}  // namespace loopwarden::analysis
