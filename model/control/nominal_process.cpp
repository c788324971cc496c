// SPDX-License-Identifier: Apache-2.0
#include "model/control/nominal_process.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

NominalProcess::NominalProcess(const PlannedMovesSettings& settings, double period_s) noexcept
    : gain_(settings.gain),
      approach_(settings.time_constant_s > 0.0 ? -std::expm1(-period_s / settings.time_constant_s)
                                               : 1.0) {
  const double periods = std::min(settings.dead_time_s / period_s, 1e9);
  stride_ = 1 + static_cast<std::size_t>(periods / 250.0);
  delay_ = std::min(kSlots - 1,
                    static_cast<std::size_t>(std::lround(periods / static_cast<double>(stride_))));
}

void NominalProcess::reset(double stem) noexcept {
  stems_.fill(static_cast<float>(stem));
  value_ = gain_ * stem;
  phase_ = 0;
}

void NominalProcess::step(double stem) noexcept {
  if (phase_ == 0) newest_ = (newest_ + 1) % kSlots;
  stems_[newest_] = static_cast<float>(stem);
  phase_ = (phase_ + 1) % stride_;
  const double delayed = static_cast<double>(stems_[(newest_ + kSlots - delay_) % kSlots]);
  value_ += approach_ * (gain_ * delayed - value_);
}

}  // namespace loopwarden::control
