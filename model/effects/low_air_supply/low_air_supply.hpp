// SPDX-License-Identifier: Apache-2.0
// Low air supply: the positioner can't fill the actuator fast or far enough (effect
// `low_air_supply`).
//
//   x' = clamp( (w - x) / T, -R, R ),   w = min(max(u - B, lo), L)
//   with another rate on closing, C R:  x' = clamp( (w - x) / T, -C R, R )
//   with one-sided filling (air to open, spring to close) only the opening is limited:
//   x' = min( (w - x) / T, R )
//
//   u, x  CO units     lo  lower end of the output, CO units
//   L     travel_limit, CO units: opening at which the spring balances the supply pressure
//   B     preload, CO units, >= 0: change of CO that only overcomes the spring, if a lower supply
//         gives the positioner less pressure for the same CO
//   R     rate, CO units/s, > 0: fill rate
//   T     lag, s, >= 0: time constant of the actuator volume
//   C     > 0: rate on closing over R, for an exhaust that is throttled, or wider than the supply
//
// Solved exactly over a period with u held: at the rate limit while the distance exceeds R T, then
// exponentially.
// Severity p fades it in as rate R/p, lag p T, preload p B, and travel limit u + p (L - u) beyond
// L.
//
// Errors: no exceptions; if u is not finite, neither is x until the next reset.
// Limits: no choked flow through the restriction, no supply that sags while other valves draw air,
// no positioner integral action.
//
// Source: engineering form of fault f16 (positioner supply pressure drop) of the DAMADICS
// benchmark, Bartys et al., Control Engineering Practice 14 (2006) 577-596.
#pragma once

#include <cstdint>
#include <limits>

#include "model/numeric/lanes.hpp"

namespace loopwarden::effects {

// The equation without preload, for one stem or for several stems in parallel (numeric/lanes.hpp).
template <class N>
class LowAirLaw {
 public:
  struct Air {
    N limit;  // L
    N share;  // severity p of the limit
    N rate;   // R
    N lag_s;  // T
    bool one_sided = false;
    double closing = 1.0;  // C
  };
  LowAirLaw(const Air& air, double period_s, N start) noexcept
      : x(start),
        air_(air),
        period_s_(numeric::every<N>(period_s)),
        decay_(decay_over(period_s_, period_s_ > numeric::every<N>(0.0))),
        most_opening_(air.rate * period_s_),
        closing_(numeric::every<N>(air.one_sided ? kInfinity : air.closing)),
        most_closing_(air.one_sided ? numeric::every<N>(kInfinity) : most_opening_ * closing_),
        slow_(air.rate * air.lag_s),
        quick_(slow_ + most_opening_) {}

  // Returns the position at which the stem rests for a constant u.
  N reached(N u) const noexcept {
    const N zero = numeric::every<N>(0.0);
    const N beyond = u - air_.limit;
    return u - air_.share * (beyond > zero ? beyond : zero);
  }

  N step(N u) noexcept {
    const N zero = numeric::every<N>(0.0);
    const N distance = reached(u) - x;
    // Exact except in the period in which the stem changes from the rate limit to the exponential.
    const N left =
        numeric::within(distance * decay_, distance - most_opening_, distance + most_closing_);
    const N size = numeric::magnitude(distance);
    const N side = distance > zero ? numeric::every<N>(1.0) : closing_;
    const auto turning = (size > slow_ * side) & (size < quick_ * side);
    return x = x +
               (distance - (numeric::any(turning) ? turned(distance, left, side, turning) : left));
  }

  N x;

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  // Returns the remaining distance after a period: `left`, or in lanes with `turning` the distance
  // after a part at the rate limit and an exponential part.
  template <class Mask>
  [[gnu::noinline]] N turned(N distance, N left, N side, Mask turning) const noexcept {
    const N zero = numeric::every<N>(0.0);
    const N size = numeric::magnitude(distance);
    const N rate = air_.rate * side;
    const N at_rate_s = (size - slow_ * side) / rate;
    const N rest = (size - rate * at_rate_s) * decay_over(period_s_ - at_rate_s, turning);
    return turning ? (distance < zero ? -rest : rest) : left;
  }
  template <class Mask>
  N decay_over(N time_s, Mask where) const noexcept {
    const N zero = numeric::every<N>(0.0);
    return air_.lag_s > zero ? numeric::exponential(-time_s / air_.lag_s, where) : zero;
  }

  Air air_;
  N period_s_;
  N decay_;         // factor on the distance over a period
  N most_opening_;  // largest move per period
  N closing_;       // C; infinite if the closing is not limited
  N most_closing_;
  N slow_;   // below this distance the motion is exponential
  N quick_;  // above this distance the motion is at the rate limit for the whole period
};

class LowAirSupply {
 public:
  enum class Filling : std::uint8_t { both_ways, one_sided };
  struct Parameters {
    double rate = 1.0;          // CO units/s
    double travel_limit = 1e9;  // CO units
    double lag_s = 0.0;         // s
    Filling filling = Filling::both_ways;
    double closing = 1.0;  // rate on closing over `rate`
    double preload = 0.0;  // CO units
    double shut = 0.0;     // CO units, position at which a preload holds the stem
  };

  LowAirSupply(Parameters parameters, double period_s) noexcept;

  void set_severity(double severity) noexcept;
  double reset(double u) noexcept;
  double step(double u) noexcept;

 private:
  // Returns the command after the preload of the spring, CO units.
  double beyond_spring(double u) const noexcept;

  LowAirLaw<double> at(double severity, double x) const noexcept;

  Parameters full_;
  double period_s_;
  double severity_ = 1.0;
  LowAirLaw<double> law_;  // at the present severity
};

}  // namespace loopwarden::effects
