// SPDX-License-Identifier: Apache-2.0
// Leakage: flow through a shut valve (effect `leakage`).
//
//   q = lo + L + (1 - L / (hi - lo)) (x - lo)
//
//   x, q  CO units, flow without and with the leak     lo, hi  range of the output, CO units
//   L     flow, CO units, 0 <= L <= hi - lo: flow of the shut valve
//         A fully open valve keeps its flow.
//
// IEC 60534-4 allows these shares of the rated capacity: class II 0.5 %, III 0.1 %, IV 0.01 %, V
// and VI far less. A worn or eroded seat, or a plug that something holds open, passes several per
// cent.
//
// Severity p fades it in as p L.
// Errors: no exceptions; if x is not finite, neither is q.
// Limits: the leak is one opening at one pressure drop; it doesn't grow with the pressure drop of a
// closing valve. From CO to PV it equals a lower gain plus a constant, so a record can't
// distinguish it from them.
//
// Source: IEC 60534-4 (seat leakage classes); seat and plug as two orifices in parallel.
#pragma once

namespace loopwarden::effects {

class Leakage {
 public:
  static constexpr bool kActsOnFlow = true;

  Leakage(double flow, double low, double high) noexcept
      : full_(flow), flow_(flow), low_(low), span_(high - low) {}

  void set_severity(double severity) noexcept { flow_ = full_ * severity; }
  double reset(double x) noexcept { return step(x); }
  double step(double x) noexcept { return x + flow_ * (1.0 - (x - low_) / span_); }

 private:
  double full_;  // CO units
  double flow_;  // CO units
  double low_;   // CO units
  double span_;  // CO units
};

}  // namespace loopwarden::effects
