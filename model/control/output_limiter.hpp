// SPDX-License-Identifier: Apache-2.0
// Limits the controller's output: range, deadband and rate of change, in this order.
//
//   r = clamp(u, low, high)
//   |r - out(k-1)| < deadband:  r = out(k-1)   unless r is a limit or out(k-1) is outside them
//   out(k) = clamp(r, out(k-1) - R h, out(k-1) + R h)
//
//   u, out, low, high, deadband  CO units;   R  CO units/s, infinity: no limit;   h  s
//
// The deadband spares the valve small moves. It holds the output, not the integral: the error that
// it leaves keeps integrating until the deadband is overcome. It is taken before the rate limit: a
// slow ramp, whose every step is smaller than the deadband, is not held. A limit is always reached.
// A non-finite u is passed on; the caller checks it.
#pragma once

#include <limits>

namespace loopwarden::control {

struct OutputLimits {
  double low = 0.0;                                             // CO units
  double high = 100.0;                                          // CO units
  double rate_per_s = std::numeric_limits<double>::infinity();  // CO units/s, > 0
  double deadband = 0.0;                                        // CO units, >= 0

  friend bool operator==(const OutputLimits&, const OutputLimits&) = default;
};

struct Limited {
  double output = 0.0;  // CO units
  bool at_low = false;
  bool at_high = false;
  bool rate_limited = false;
};

// `previous` is the output of one period ago.
Limited limit_output(const OutputLimits& limits, double wanted, double previous,
                     double period_s) noexcept;

}  // namespace loopwarden::control
