// SPDX-License-Identifier: Apache-2.0
#include "model/control/loop_estimator.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

LoopEstimator::LoopEstimator(const PlannedMovesSettings& settings, bool shadow,
                             double period_s) noexcept
    : read_back_(settings.read_back),
      shadow_(shadow),
      period_s_(period_s),
      gain_(settings.gain),
      friction_(settings),
      real_stem_(settings, period_s),
      disturbance_(settings, period_s),
      shadow_loop_{.stem = {}, .process = NominalProcess(settings, period_s)} {}

void LoopEstimator::observe(const CompensatorInputs& in, bool active, bool learns,
                            double held) noexcept {
  limits_ = in.limits;
  set_point_ = in.set_point;
  real_stem_.step(in, learns, friction_);
  disturbance_.step(in.process_variable, real_stem_.stem().position);
  error_ = in.set_point - in.process_variable;
  if (!shadow_ || !active) return;
  ShadowLoop& shadow = shadow_loop_;
  shadow.output = limit_output(in.limits, held, shadow.output, period_s_).output;
  shadow.stem.step(shadow.output, friction_, period_s_);
  shadow.process.step(shadow.stem.stem().position);
  error_ += disturbance_.process().value() - shadow.process.value();
}

void LoopEstimator::take_over(double output) noexcept {
  shadow_loop_.output = output;
  shadow_loop_.stem.begin(real_stem_.model(), output);
  shadow_loop_.process = disturbance_.process();
}

void LoopEstimator::reset_travel() noexcept {
  real_stem_.reset_travel();
  shadow_loop_.stem.stem().travel = 0.0;
}

double LoopEstimator::margin(double given_j) const noexcept {
  return std::max(4.0 * std::sqrt(disturbance_.noise_variance()), 0.1 * std::abs(gain_) * given_j);
}

}  // namespace loopwarden::control
