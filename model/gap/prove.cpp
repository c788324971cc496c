// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <algorithm>
#include <cmath>

#include "model/gap/constants.hpp"

namespace loopwarden::gap {

double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept {
  if (!(before_rmse >= kGapFloors * floor_rmse) || !(before_rmse > 0.0)) return kNone;
  const double before = before_rmse * before_rmse;
  const double closed = (before - after_rmse * after_rmse) / (before - floor_rmse * floor_rmse);
  return std::clamp(closed, -1.0, 1.0);
}

Proof judge(const Trial& t) noexcept {
  if (t.choice_rmse > std::hypot(t.model_rmse, t.trifle_rmse)) return Proof::refuted;
  if (std::isfinite(t.closed)) {
    return t.closed >= kClosed         ? Proof::holds
           : t.closed >= kPartlyClosed ? Proof::partly
                                       : Proof::refuted;
  }
  const bool holds = t.rest_is_noise
                         ? t.choice_innovations < kWorstInnovations * t.model_innovations
                         : t.choice_rmse <= kWorstHoldout * t.model_rmse;
  return t.believable && holds ? Proof::holds : Proof::refuted;
}

Trial try_on_holdout(const ModelFit& model_fit, const Fit& model, const Fit& choice,
                     const CheckedRecord& record, const Residuals& left, const Floor& floor,
                     const Misfit& before, const Misfit& after) {
  Trial trial{.believable = left.believable,
              .rest_is_noise = left.adequate,
              .closed = gap_closed(before.holdout_rmse, after.holdout_rmse, floor.rmse()),
              .model_rmse = before.holdout_rmse,
              .choice_rmse = after.holdout_rmse,
              .trifle_rmse = std::hypot(floor.transmitter_rmse, model_fit.least_rms)};
  if (!left.adequate || std::isfinite(trial.closed)) return trial;
  const Fitter whole = model_fit.over_whole_record();
  const auto first = std::count(record.training.begin(), record.training.end(), true);
  const auto sum = [&](const Fit& fit) {
    const std::vector<double> e = whole.innovations(fit);
    double squares = 0.0;
    for (auto i = static_cast<std::size_t>(first); i < e.size(); ++i) squares += e[i] * e[i];
    return squares * fit.noise_rms * fit.noise_rms;
  };
  Fit base = model;
  base.load = choice.load;
  trial.model_innovations = sum(base);
  trial.choice_innovations = sum(choice);
  return trial;
}

}  // namespace loopwarden::gap
