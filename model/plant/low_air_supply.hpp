// SPDX-License-Identifier: Apache-2.0
// Low air supply: the positioner can't fill the actuator fast or far enough (effect
// `low_air_supply`).
//
//   x' = clamp( (w - x) / T, -R, R ),   w = min(max(u - B, lo), L)
//   with one-sided filling (air to open, spring to close) only the opening is limited:
//   x' = min( (w - x) / T, R )
//
//   u, x  CO units     L  travel_limit, CO units: where the spring balances the supply pressure
//   B     preload, CO units, >= 0: what the spring takes before the stem moves, where less supply
//         leaves the positioner less pressure for the same CO;  lo  lower end of the output
//   R     rate, CO units/s, > 0: fill rate     T  lag, s, >= 0: time constant of the actuator volume
//
// Solved exactly over a period with u held: at the rate limit while the distance exceeds R T, then
// exponentially. Severity p fades it in as rate R/p, lag p T, preload p B, and travel
// limit u + p (L - u) beyond L.
//
// Errors: none; a non-finite u gives a non-finite x until the next reset.
// What it can't do: no choked flow through the restriction, no supply that sags while other valves
// draw air, no positioner integral action.
//
// Source: engineering form of fault f16 (positioner supply pressure drop) of the DAMADICS benchmark,
// Bartys et al., Control Engineering Practice 14 (2006) 577-596.
#pragma once

#include <cstdint>

namespace loopwarden::plant {

class LowAirSupply {
 public:
  enum class Filling : std::uint8_t { both_ways, one_sided };
  struct Parameters {
    double rate = 1.0;          // CO units/s
    double travel_limit = 1e9;  // CO units
    double lag_s = 0.0;         // s
    Filling filling = Filling::both_ways;
    double preload = 0.0;  // CO units
    double shut = 0.0;     // CO units, where a preload holds the stem
  };

  LowAirSupply(Parameters parameters, double period_s) noexcept;

  void set_severity(double severity) noexcept;
  double reset(double u) noexcept;
  double step(double u) noexcept;

 private:
  double limited(double u) const noexcept;

  Parameters full_;
  double period_s_;
  double severity_ = 1.0;
  double rate_ = 0.0;  // CO units/s at the present severity
  double lag_s_ = 0.0;
  double x_ = 0.0;  // CO units
};

}  // namespace loopwarden::plant
