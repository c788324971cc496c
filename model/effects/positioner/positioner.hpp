// SPDX-License-Identifier: Apache-2.0
// A pneumatic positioner with a dead band and a seat (effect `positioner`).
//
//   e  = u - x
//   z' = G dz(e),   dz(e) = e - sign(e) min(|e|, D/2);  0 while the valve is shut and e < B
//   T x' = z - x,   both held within the range of the output
//
//   u, x  CO units    command and stem
//   z     CO units    pressure, as the stem position that it holds
//   G     1/s, > 0    gain of the relay
//   T     s, > 0      lag of the actuator's volume
//   D     dead_band, CO units, >= 0
//   B     breakaway, CO units, >= 0: e that opens a shut valve
//
// Inside the dead band the stem keeps its position: two commands D apart can give the same stem
// position, which is the loss on a reversal. After a large step the stem overshoots if G T > 1/4,
// and the dead band keeps the remaining overshoot. The valve counts as shut if neither z nor x
// exceeds 0.2 % of the span.
//
// z is integrated by Euler's rule, x exactly for the new z. Steps are at most 25 ms and 1 / (2 G).
// Severity p fades it in as u + p (x - u).
// Errors: no exceptions; if u is not finite, the stem keeps its position.
// Limits: no rate limit of filling or venting (see low_air_supply.hpp), no friction in the packing
// (see stiction_choudhury.hpp), the same dead band along the whole travel.
//
// Source: dead band and relay gain as positioner properties in IEC 61514 and ISA-75.25.01; the
// integrating relay on a volume: Merritt, Hydraulic Control Systems (1967), ch. 6; seat: own model.
#pragma once

namespace loopwarden::effects {

class Positioner {
 public:
  struct Parameters {
    double dead_band = 0.0;   // CO units
    double gain_per_s = 1.0;  // 1/s
    double lag_s = 0.1;       // s
    double breakaway = 0.0;   // CO units
  };

  // `period_s` > 0; `low` and `high`: range of the output, CO units.
  Positioner(const Parameters& parameters, double low, double high, double period_s) noexcept;

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept;
  double step(double u) noexcept;

 private:
  double low_;           // CO units
  double high_;          // CO units
  double half_band_;     // CO units
  double breakaway_;     // CO units
  double shut_below_;    // CO units
  double gain_substep_;  // G times the substep
  double approach_;      // share of z - x by which x moves in a substep
  int substeps_;
  double severity_ = 1.0;
  double z_ = 0.0;  // CO units
  double x_ = 0.0;  // CO units
};

}  // namespace loopwarden::effects
