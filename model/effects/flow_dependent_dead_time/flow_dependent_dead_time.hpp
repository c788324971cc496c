// SPDX-License-Identifier: Apache-2.0
// Dead time that depends on the flow (effect `flow_dependent_dead_time`): the fluid that leaves a
// pipe is as old as the time in which the flow displaces the content of the pipe.
//
//   x(t) = u(t - L(t)),   integral of max(u/N, 0.1)^n over [t - L(t), t] = L0
//
// At rest L = L0 (N/u)^n. If PV is the flow, L = L0 (nominal PV/PV)^n.
//
//   u, x  CO units, the flow as the opening of a linear installed valve
//   L0    s, the dead time of the process, which this law replaces
//   N     nominal, CO units, > 0: the flow at which the dead time is L0
//   n     exponent, 0 to 3; 1: plug flow through a pipe
//
// Occurs if the measured property travels with the controlled flow: temperature or concentration at
// the end of a pipe, solids on a belt of varying speed, a sample line.
//
// Severity p fades it in as p n. Flows below N/10 count as N/10, and no dead time is longer than 10
// L0.
// Errors: the constructor throws std::length_error if the dead time doesn't fit in memory.
// Limits: no mixing in the pipe; not for a pipe whose flow another valve sets.
//
// Source: Zenger and Niemi, Automatica 45 (2009) 1291-1298 (processes with varying transport
// delay).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "model/effects/delay_line.hpp"

namespace loopwarden::effects {

class FlowDependentDeadTime {
 public:
  FlowDependentDeadTime(double dead_time_s, double exponent, double nominal, double period_s)
      : samples_(dead_time_s / period_s),
        full_(exponent),
        exponent_(exponent),
        nominal_(nominal),
        longest_(static_cast<std::size_t>(kLongest * samples_) + 1),
        signal_(longest_ + 1),
        pace_(longest_ + 1) {}

  void set_severity(double severity) noexcept { exponent_ = full_ * severity; }
  double reset(double u) noexcept {
    signal_.fill(u);
    const double pace = pace_at(u);
    pace_.fill(pace);
    whole_ = std::min(static_cast<std::size_t>(samples_ / pace), longest_ - 1);
    displaced_ = pace * static_cast<double>(whole_);
    return u;
  }
  double step(double u) noexcept {
    // The inflow of the previous sample is now in the pipe and counts as displaced volume.
    displaced_ += pace_.at(0);
    ++whole_;
    signal_.push(u);
    pace_.push(pace_at(u));
    while (whole_ > 0 && (displaced_ > samples_ || whole_ >= longest_)) {
      displaced_ -= pace_.at(whole_);
      --whole_;
    }
    const double part = std::clamp((samples_ - displaced_) / pace_.at(whole_ + 1), 0.0, 1.0);
    return std::lerp(signal_.at(whole_), signal_.at(whole_ + 1), part);
  }

 private:
  static constexpr double kLongest = 10.0;   // times the nominal dead time
  static constexpr double kLeastFlow = 0.1;  // share of the nominal flow

  // Returns the displacement by one sample of u, in samples of the nominal flow.
  double pace_at(double u) const noexcept {
    const double ratio = u / nominal_;
    return std::pow(ratio > kLeastFlow ? ratio : kLeastFlow, exponent_);
  }

  double samples_;       // L0, in samples
  double full_;          // n
  double exponent_;      // n at the present severity
  double nominal_;       // CO units
  std::size_t longest_;  // samples
  DelayLine signal_;     // CO units
  DelayLine pace_;
  std::size_t whole_ = 0;   // number of samples in the pipe
  double displaced_ = 0.0;  // their displacement, in samples of the nominal flow
};

}  // namespace loopwarden::effects
