// SPDX-License-Identifier: Apache-2.0
// Leakage: flow through a valve that is shut (effect `leakage`).
//
//   q = lo + L + (1 - L / (hi - lo)) (x - lo)
//
//   x, q  CO units, flow without and with the leak     lo, hi  range of the output, CO units
//   L     flow, CO units, 0 <= L <= hi - lo: what passes at shut; fully open nothing changes
//
// Allowed of the rated capacity by IEC 60534-4: class II 0.5 %, III 0.1 %, IV 0.01 %; V and VI far less.
// A worn or eroded seat, or one that something holds open, passes several per cent.
//
// Severity p fades it in as p L.
// Errors: no exceptions; if x is not finite, neither is q.
// Limits: the leak is one opening at one pressure drop; it does not grow as the drop does when
// the valve shuts. Between CO and PV it is a lower gain and a constant, so no record tells it from these two.
//
// Source: IEC 60534-4 (seat leakage classes); seat and plug as two orifices in parallel.
#pragma once

namespace loopwarden::plant {

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

}  // namespace loopwarden::plant
