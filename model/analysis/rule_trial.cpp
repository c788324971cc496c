// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/rule_trial.hpp"

#include "model/analysis/limits.hpp"

namespace loopwarden::analysis {

double watched_s(const plant::ProcessParameters& process) noexcept {
  // The rules make an integrating loop slow: integral times are up to 13 dead times.
  if (process.integrating()) return 100.0 * process.lags_and_dead_time_s();
  return 15.0 *
         (2.0 * (process.time_constant_s + process.second_time_constant_s) + process.dead_time_s);
}

std::vector<RuleTrial> try_rules(const plant::LoopModel& model, const TuningOptions& options,
                                 std::optional<double> filter_s) {
  std::vector<RuleTrial> trials;
  const double half_s = watched_s(model.process) + 10.0 * model.sample_time_s;
  const auto add = [&](std::optional<TuningRule> rule, const control::PidGains& gains) {
    RuleTrial trial{.rule = rule, .gains = gains};
    LinearLoop linear = linear_loop(model);
    linear.gains = gains;
    trial.margins = margins(linear);
    trial.response = predict_response(model, gains, half_s);
    trials.push_back(std::move(trial));
  };
  add(std::nullopt, model.controller.pid.gains);
  for (const TuningRule rule : kTuningRules) {
    std::optional<control::PidGains> gains = tune(rule, model.process, options);
    if (!gains) continue;
    gains->derivative_filter_s = filter_s.value_or(gains->derivative_filter_s);
    add(rule, *gains);
  }
  return trials;
}

const RuleTrial* recommended(const std::vector<RuleTrial>& trials) noexcept {
  const RuleTrial* best = nullptr;
  for (const RuleTrial& trial : trials) {
    if (!trial.rule || !trial.scales() || !trial.margins.stable || !trial.response.settles ||
        trial.margins.sensitivity > Limits::kMostSensitivity) {
      continue;
    }
    if (best == nullptr ||
        trial.response.load_absolute_error < best->response.load_absolute_error) {
      best = &trial;
    }
  }
  return best;
}

}  // namespace loopwarden::analysis
