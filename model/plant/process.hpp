// SPDX-License-Identifier: Apache-2.0
// The process: gain, first-order lag and dead time.
//
//   T q' = K u(t - L) - q
//   exactly sampled for u held over each period, L = (n + f) h with n whole and 0 <= f < 1:
//   q(k+1) = a q(k) + (a^(1-f) - a) K u(k-n-1) + (1 - a^(1-f)) K u(k-n),   a = exp(-h/T)
//
//   u  flow command, CO units     q  PV units     K  gain, PV units / CO unit
//   T  time_constant, s, > 0      L  dead_time, s, >= 0     h  s
//
// Errors: the constructor throws std::length_error for a dead time beyond what fits in memory; a
// non-finite u gives a non-finite q until the next reset.
// What it can't do: one lag, self-regulating only, linear about zero.
//
// Source: Åström and Wittenmark, Computer-Controlled Systems (1997), section 2.3 (time delay).
#pragma once

#include <cstddef>

#include "model/plant/delay_line.hpp"

namespace loopwarden::plant {

struct ProcessParameters {
  double gain = 1.0;             // PV units / CO unit
  double time_constant_s = 1.0;  // s
  double dead_time_s = 0.0;      // s

  friend bool operator==(const ProcessParameters&, const ProcessParameters&) = default;
};

class Process {
 public:
  Process(const ProcessParameters& parameters, double period_s);

  double reset(double u) noexcept;
  double step(double u) noexcept {
    line_.push(u);
    q_ = keep_ * q_ + early_ * line_.at(whole_ + 1) + late_ * line_.at(whole_);
    return q_;
  }

 private:
  double gain_;         // PV units / CO unit
  double keep_;         // a
  double early_ = 0.0;  // weight of the older input
  double late_ = 0.0;   // weight of the newer input
  std::size_t whole_;   // n
  DelayLine line_;
  double q_ = 0.0;  // PV units
};

}  // namespace loopwarden::plant
