// SPDX-License-Identifier: Apache-2.0
// Single readings that are far off (effect `spikes`).
//
//   y = q + A z,  z = 1 or -1 with a probability of P/2 each, otherwise 0; samples are independent
//
//   q, y  PV units, noise included     A  size, PV units, >= 0     P  share of the samples, 0 to 1
//
// Causes: loose contacts, interference, bubbles at an electrode, echoes of a level radar.
//
// Severity p fades it in as p A.
// Errors: no exceptions; if q is not finite, neither is y.
// Limits: all spikes have the same size and last one sample; real spikes occur in bursts.
//
// Source: Menold, Pearson and Allgower, Control Engineering Practice 7 (1999) 1185-1200 (additive
// outliers).
#pragma once

#include <cstdint>

#include "model/numeric/random.hpp"

namespace loopwarden::effects {

class Spikes {
 public:
  static constexpr bool kActsOnReading = true;

  Spikes(double share, double size, std::uint64_t seed) noexcept
      : share_(share), size_(size), random_(seed) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return q; }
  double step(double q) noexcept {
    const double chance = random_.uniform();
    if (chance >= share_) return q;
    return q + severity_ * (chance < 0.5 * share_ ? size_ : -size_);
  }

 private:
  double share_;
  double size_;  // PV units
  double severity_ = 1.0;
  numeric::Random random_;
};

}  // namespace loopwarden::effects
