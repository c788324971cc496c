// SPDX-License-Identifier: Apache-2.0
// Set point with limits and a ramp.
//
//   working(k) = clamp(target, working(k-1) - Rd h, working(k-1) + Ru h)
//
//   target, working  PV units, target within [low, high];   Ru, Rd  PV units/s, infinity: no ramp
#pragma once

#include <limits>

namespace loopwarden::control {

struct SetPointLimits {
  double low = 0.0;                                                  // PV units
  double high = 100.0;                                               // PV units
  double rate_up_per_s = std::numeric_limits<double>::infinity();    // PV units/s, > 0
  double rate_down_per_s = std::numeric_limits<double>::infinity();  // PV units/s, > 0

  friend bool operator==(const SetPointLimits&, const SetPointLimits&) = default;
};

class SetPoint {
 public:
  SetPoint(const SetPointLimits& limits, double initial) noexcept;

  void configure(const SetPointLimits& limits) noexcept;
  // Requests a value, clamped to the limits. A non-finite value is ignored.
  void request(double target) noexcept;
  // Makes the ramp start again from here (limits apply).
  void restart_ramp(double from) noexcept;
  // One period; returns the working set point.
  double step(double period_s) noexcept;

  double target() const noexcept { return target_; }
  double working() const noexcept { return working_; }
  bool ramped() const noexcept;

 private:
  SetPointLimits limits_;
  double target_;
  double working_;
};

}  // namespace loopwarden::control
