// SPDX-License-Identifier: Apache-2.0
// Dead time in addition to that of the process (effect `extra_dead_time`).
//
//   x(t) = u(t - T),  linear between samples
//
//   u, x  same units     T  seconds, s, >= 0
//
// Severity p fades it in as p T.
// Errors: the constructor throws std::length_error if the dead time doesn't fit in memory.
// Limits: between samples it interpolates linearly, although the held signal has a step.
#pragma once

#include <cstddef>

#include "model/effects/delay_line.hpp"

namespace loopwarden::effects {

class ExtraDeadTime {
 public:
  ExtraDeadTime(double seconds, double period_s)
      : samples_(seconds / period_s), line_(static_cast<std::size_t>(samples_) + 2) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    const double samples = samples_ * severity;
    whole_ = static_cast<std::size_t>(samples);
    fraction_ = samples - static_cast<double>(whole_);
  }
  double reset(double u) noexcept {
    line_.fill(u);
    return u;
  }
  double step(double u) noexcept {
    line_.push(u);
    return (1.0 - fraction_) * line_.at(whole_) + fraction_ * line_.at(whole_ + 1);
  }

 private:
  double samples_;
  DelayLine line_;
  std::size_t whole_ = 0;
  double fraction_ = 0.0;
};

}  // namespace loopwarden::effects
