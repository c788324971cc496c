// SPDX-License-Identifier: Apache-2.0
// Backlash compensation: at each reversal of CO the gap is added at once, so that the valve follows
// without the time it takes to cross it (kind `backlash`).
//
//   u = uc + c,   c falls by the gap when uc turns downwards, and rises by it when uc turns upwards
//   c = 0 in the direction in which uc goes first
//
//   u, uc, c  CO units     gap  CO units, all that CO loses on a reversal: at most the valve's dead band
//
// That is Hägglund's u = uc + (gap/2) sign(duc) without its jump at the start. A gap above the valve's
// dead band pushes the stem too far at each reversal, which makes the loop cycle; 70 to 100 % of an estimate is
// used. Reversals below `noise_band` are none: set it above the noise that PV's gain leaves in CO.
//
// Source: Hägglund, J. Process Control 17 (2007) 489-499; Tao and Kokotovic (1996), ch. 3.
#pragma once

#include "model/control/compensator_contract.hpp"
#include "model/control/turns.hpp"

namespace loopwarden::control {

class BacklashCompensator {
 public:
  BacklashCompensator(const CompensatorSettings& settings, double) noexcept
      : gap_(settings.gap), turns_(settings.noise_band) {}

  void reset(double output) noexcept {
    turns_.reset(output);
    first_ = 0;
  }

  Correction step(const CompensatorInputs& in) noexcept {
    const int direction = turns_.step(in.output);
    if (first_ == 0) first_ = direction;
    return {.added = gap_ / 2.0 * (direction - first_)};
  }

 private:
  double gap_;  // CO units
  Turns turns_;
  int first_ = 0;
};

}  // namespace loopwarden::control
