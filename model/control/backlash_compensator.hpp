// SPDX-License-Identifier: Apache-2.0
// Adds the gap of a valve to CO at each reversal, so that the stem follows at once (kind
// `backlash`).
//
//   u = uc + c       c falls by the gap when uc turns downwards, rises by it when uc turns upwards
//   c = 0            until uc has reversed for the first time
//
//   u, uc, c  CO units      gap  CO units, at most the lost motion of the valve on a reversal
//
// This is Hägglund's u = uc + (gap/2) sign(duc) without its jump at the start. A gap above the
// valve's dead band makes the loop cycle: use 70 to 100 % of the estimate. Reversals below
// `noise_band` do not count: set it above the noise that PV's gain leaves in CO.
//
// Source: Hägglund, J. Process Control 17 (2007) 489-499; Tao and Kokotovic (1996), ch. 3.
#pragma once

#include "model/control/compensator_contract.hpp"
#include "model/control/reversals.hpp"

namespace loopwarden::control {

class BacklashCompensator {
 public:
  BacklashCompensator(const CompensatorSettings& settings, double) noexcept
      : gap_(settings.gap), reversals_(settings.noise_band) {}

  void reset(double output) noexcept {
    reversals_.reset(output);
    first_ = 0;
  }

  Correction step(const CompensatorInputs& in) noexcept {
    const int direction = reversals_.step(in.output);
    if (first_ == 0) first_ = direction;
    return {.added = gap_ / 2.0 * (direction - first_)};
  }

 private:
  double gap_;  // CO units
  Reversals reversals_;
  int first_ = 0;
};

}  // namespace loopwarden::control
