// SPDX-License-Identifier: Apache-2.0
// The transmitter: noise, range and resolution.
//
//   y = lo + r round( (clamp(q + N n, lo, hi) - lo) / r )
//
//   q, y, lo, hi  PV units     N  noise, standard deviation, PV units, >= 0
//   r  resolution, PV units, >= 0 (0: no rounding)
//   n  normal with standard deviation 1, from a seed
//
// Errors: no exceptions; if q is not a number, y = lo. (hi - lo) / r must stay below 2^53.
// Limits: only white noise. Lag, bias and drift are separate effects.
#pragma once

#include <algorithm>
#include <cstdint>

#include "model/numeric/random.hpp"

namespace loopwarden::plant {

struct TransmitterParameters {
  double low = 0.0;         // PV units
  double high = 10.0;       // PV units
  double resolution = 0.0;  // PV units
  double noise = 0.0;       // PV units

  double span() const noexcept { return high - low; }
  friend bool operator==(const TransmitterParameters&, const TransmitterParameters&) = default;
};

class Transmitter {
 public:
  Transmitter(const TransmitterParameters& parameters, std::uint64_t seed) noexcept
      : parameters_(parameters), random_(seed) {}

  double step(double q) noexcept {
    const TransmitterParameters& p = parameters_;
    if (p.noise > 0.0) q += p.noise * random_.normal();
    q = q >= p.low ? std::min(q, p.high) : p.low;  // if q is not a number, y = lo
    if (p.resolution > 0.0) {
      // The value is not negative after the clamp, so the cast rounds to the nearest step.
      // NOLINTNEXTLINE(bugprone-incorrect-roundings): lround is a call, and q - low is not negative
      const auto steps = static_cast<std::int64_t>((q - p.low) / p.resolution + 0.5);
      q = p.low + p.resolution * static_cast<double>(steps);
    }
    return q;
  }

 private:
  TransmitterParameters parameters_;
  numeric::Random random_;
};

}  // namespace loopwarden::plant
