// SPDX-License-Identifier: Apache-2.0
// Compares SP - PV under planned moves with the loop without them, and reports when they must end.
//
// Two tests: the RMS of windows of four cycles, and the excess of squared error over the baseline's
// variance. docs/math/planned-moves.md has the limits. No call allocates or throws.
#pragma once

#include <cstdint>

#include "model/control/cycle_statistics.hpp"
#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

class BenefitMonitor {
 public:
  explicit BenefitMonitor(double period_s) noexcept : period_s_(period_s) {}

  void restart() noexcept { *this = BenefitMonitor(period_s_); }
  // One period. Returns no_gain or error_too_large if planned moves must end.
  DisengageReason add(double error, double noise_variance, const LoopBaseline& baseline) noexcept;

  double gain() const noexcept { return gain_; }  // RMS over that without; 0: not known yet
  // PV units^2 s by which the squared error may still exceed the baseline's.
  double remaining_excess(const LoopBaseline& baseline) const noexcept;

 private:
  bool end_window(double noise_variance, const LoopBaseline& baseline) noexcept;

  double period_s_;
  double window_squares_ = 0.0;  // PV units^2 s
  double window_s_ = 0.0;
  std::uint32_t windows_ = 0;
  double gain_ = 0.0;
  double excess_ = 0.0;  // of squared error over the baseline's, PV units^2 s
};

}  // namespace loopwarden::control
