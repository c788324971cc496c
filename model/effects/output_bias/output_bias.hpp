// SPDX-License-Identifier: Apache-2.0
// Bias of the transmitter (effect `output_bias`).
//
//   y = q + B       q, y, B  PV units
//
// Limits: a single record can't distinguish it from a constant disturbance.
#pragma once

namespace loopwarden::effects {

class OutputBias {
 public:
  explicit OutputBias(double bias) noexcept : full_(bias), bias_(bias) {}

  void set_severity(double severity) noexcept { bias_ = full_ * severity; }
  double reset(double q) noexcept { return step(q); }
  double step(double q) noexcept { return q + bias_; }

 private:
  double full_;  // PV units
  double bias_;  // PV units
};

}  // namespace loopwarden::effects
