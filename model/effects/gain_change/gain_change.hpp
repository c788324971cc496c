// SPDX-License-Identifier: Apache-2.0
// Change of the process gain (effect `gain_change`).
//
//   x = F u         u, x  CO units, at the input of the process     F  factor, > 0; 1: no change
//
// Severity p fades it in as factor 1 + p (F - 1).
// Limits: no gain that depends on the operating point, which is `valve_characteristic`.
#pragma once

namespace loopwarden::effects {

class GainChange {
 public:
  explicit GainChange(double factor) noexcept : full_(factor), factor_(factor) {}

  void set_severity(double severity) noexcept { factor_ = 1.0 + severity * (full_ - 1.0); }
  double reset(double u) noexcept { return step(u); }
  double step(double u) noexcept { return factor_ * u; }

 private:
  double full_;
  double factor_;
};

}  // namespace loopwarden::effects
