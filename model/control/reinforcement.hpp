// SPDX-License-Identifier: Apache-2.0
// Adds a constant to CO in the direction in which it moves (kind `reinforcement`). It acts in
// `simulate` and `compare` only; a running loop has it in shadow.
//
//   u = uc + a sign(duc)        0 until uc has first moved by more than the noise band
//
//   u, uc  CO units     a  amplitude, CO units: about half the stick band     sign by reversals.hpp
//
// Limits: at each reversal CO jumps by 2 a whether or not the valve needs it, and a valve that
// slips by itself is pushed further. After its start it equals backlash_compensator.hpp with a gap
// of 2 a.
//
// Source: Ivan and Lakshminarayanan, ISA Transactions 48 (2009) 512-521; the noise band is this
// project's.
#pragma once

#include "model/control/compensator_contract.hpp"
#include "model/control/reversals.hpp"

namespace loopwarden::control {

class Reinforcement {
 public:
  Reinforcement(const CompensatorSettings& settings, double) noexcept
      : amplitude_(settings.amplitude), reversals_(settings.noise_band) {}

  void reset(double output) noexcept { reversals_.reset(output); }

  Correction step(const CompensatorInputs& in) noexcept {
    return {.added = amplitude_ * reversals_.step(in.output)};
  }

 private:
  double amplitude_;  // CO units
  Reversals reversals_;
};

}  // namespace loopwarden::control
