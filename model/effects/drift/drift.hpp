// SPDX-License-Identifier: Apache-2.0
// Drift of the transmitter (effect `drift`).
//
//   y = q + R t     q, y  PV units     R  rate, PV units/s     t  s, from the start of the record
//
// Limits: no separate saturation; the range of the transmitter ends the drift.
#pragma once

namespace loopwarden::effects {

class Drift {
 public:
  explicit Drift(double rate_per_s) noexcept : rate_per_s_(rate_per_s) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return q; }
  double step(double q, double time_s) noexcept { return q + severity_ * rate_per_s_ * time_s; }

 private:
  double rate_per_s_;  // PV units/s
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
