// SPDX-License-Identifier: Apache-2.0
// The process: gain, one or two first-order lags, and dead time. An integrator can replace the
// first lag.
//
//   self-regulating   T q1' = K u(t - L) - q1         T2 q' = q1 - (q - level)
//   integrating          q1' = K (u(t - L) - u0)      T2 q' = q1 - q
//
// exactly sampled for u held over each period, L = (n + f) h with n whole and 0 <= f < 1:
//   lag          x(k+1) = a x(k) + (a^(1-f) - a) u(k-n-1) + (1 - a^(1-f)) u(k-n),   a = exp(-h/T)
//   integrator   x(k+1) = x(k) + f h u(k-n-1) + (1 - f) h u(k-n)
//   two in series by partial fractions: q = K (T x_T - T2 x_T2)/(T - T2), q = q0 + K (x - T2 x_T2)
//
//   level  PV at u = 0 at rest, PV units
//   u  flow command, CO units     q  PV units
//   K  gain, PV units / CO unit; integrating: PV units / (CO unit s)
//   T  time_constant, s, > 0      T2  second_time_constant, s, >= 0; 0: no second lag
//   L  dead_time, s, >= 0         h  s
//   u0  u at which an integrating process rests: u at reset()
//
// Equal lags are changed to differ by a thousandth, which has no visible effect on q.
//
// Errors: the constructor throws std::length_error if the dead time doesn't fit in memory; if u is
// not finite, neither is q until the next reset.
// Limits: linear about zero (self-regulating) or about the state at the reset (integrating); an
// integrating process has no ends: a tank neither overflows nor runs dry.
//
// Source: Åström and Wittenmark, Computer-Controlled Systems (1997), section 2.3 (time delay).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "model/effects/delay_line.hpp"

namespace loopwarden::plant {

enum class ProcessKind : std::uint8_t { self_regulating, integrating };
const char* to_text(ProcessKind kind) noexcept;

struct ProcessParameters {
  double gain = 1.0;                    // PV units / CO unit; integrating: PV units / (CO unit s)
  double time_constant_s = 1.0;         // s; ignored if integrating
  double dead_time_s = 0.0;             // s
  double second_time_constant_s = 0.0;  // s; 0: no second lag
  ProcessKind kind = ProcessKind::self_regulating;
  // PV at CO 0 without disturbance, PV units. Empty if the file doesn't state it; a simulation then
  // uses 0. Only for a self-regulating process.
  std::optional<double> level{};

  bool integrating() const noexcept { return kind == ProcessKind::integrating; }
  // Returns the sum of the lags and the dead time, s; an integrator counts as 0.
  double lags_and_dead_time_s() const noexcept {
    return (integrating() ? 0.0 : time_constant_s) + second_time_constant_s + dead_time_s;
  }

  friend bool operator==(const ProcessParameters&, const ProcessParameters&) = default;
};

class Process {
 public:
  Process(const ProcessParameters& parameters, double period_s);

  // Sets the process to rest at `u` and returns PV. `level`, PV units: PV at u = 0; an integrating
  // process rests at `level` for every u.
  double reset(double u, double level = 0.0) noexcept;
  double step(double u) noexcept {
    line_.push(u - balance_);
    const double older = line_.at(whole_ + 1);
    const double newer = line_.at(whole_);
    first_ = keep_ * first_ + early_ * older + late_ * newer;
    if (!second_) return first_ + level_;
    lag_ = lag_keep_ * lag_ + lag_early_ * older + lag_late_ * newer;
    return level_ + share_ * first_ - lag_share_ * lag_;
  }

 private:
  double gain_;  // PV units / CO unit
  bool integrating_;
  bool second_;
  double keep_;            // a of the lag, 1 of the integrator
  double early_ = 0.0;     // weight of the older input, with the gain
  double late_ = 0.0;      // weight of the newer input, with the gain
  double lag_keep_ = 0.0;  // the same for the second lag
  double lag_early_ = 0.0;
  double lag_late_ = 0.0;
  double share_ = 1.0;  // partial fractions
  double lag_share_ = 0.0;
  std::size_t whole_;  // n
  effects::DelayLine line_;
  double balance_ = 0.0;  // u0, CO units
  double level_ = 0.0;    // PV units, `level` of reset()
  double first_ = 0.0;    // PV units
  double lag_ = 0.0;      // PV units
};

}  // namespace loopwarden::plant
