// SPDX-License-Identifier: Apache-2.0
// Random disturbance: a slow random walk that returns to zero (effect `random_load`).
//
//   d' = -d / T + S w,  exactly sampled:
//   d(k) = a d(k-1) + S sqrt(T (1 - a^2) / 2) n,  a = exp(-h/T)
//   y = q + d
//
//   q, y, d  PV units     S  intensity, PV units per root second, >= 0     T  time_constant, s, > 0
//   w  white noise        n  normal with standard deviation 1                h  s
//
// Limits: it is added to PV, not before the process; Gaussian, without steps or bursts.
//
// Source: Uhlenbeck and Ornstein, Phys. Rev. 36 (1930) 823-841.
#pragma once

#include <cmath>
#include <cstdint>

#include "model/numeric/random.hpp"

namespace loopwarden::effects {

class RandomLoad {
 public:
  RandomLoad(double intensity, double time_constant_s, double period_s, std::uint64_t seed) noexcept
      : keep_(std::exp(-period_s / time_constant_s)),
        kick_(intensity *
              std::sqrt(-time_constant_s * std::expm1(-2.0 * period_s / time_constant_s) / 2.0)),
        random_(seed) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept {
    load_ = 0.0;
    return q;
  }
  double step(double q) noexcept {
    load_ = keep_ * load_ + kick_ * random_.normal();
    return q + severity_ * load_;
  }

 private:
  double keep_;        // a
  double kick_;        // PV units
  double load_ = 0.0;  // PV units
  double severity_ = 1.0;
  numeric::Random random_;
};

}  // namespace loopwarden::effects
