// SPDX-License-Identifier: Apache-2.0
// The PI and PID law in positional form, with its integral kept in CO units.
//
//   e(k) = SP - PV (reverse action) or PV - SP (direct action)
//   I(k) = I(k-1) + ( Ki e(k) + w(k) ) h                 then limited by the anti-windup below
//   D(k) = a D(k-1) + (1 - a) Kd d(k),  d(k) = -+ (PV(k) - PV(k-1)) / h,  a = exp(-h / Tf)
//   u(k) = Kp e(k) + I(k) + D(k)
//
//   h   sampling period, s                    w   additional rate (stickband jacket), CO units/s
//   Tf  derivative filter, s; 0: unfiltered   u   calculated output, CO units, before any limit
//
// The derivative acts on PV only, so that a set-point step gives no kick. `u_out` below is
// the output written one period ago: after limits, rate limit, and the converter.
//
// Anti-windup:
//   integral_clamp    I is held within the output's span: [-(hi - lo), hi - lo]; the caller clamps
//                     the sum. An I that starts outside is not moved; it may only move inwards.
//   back_calculation  w gets + (u_out - u) / Tt from the period before; Tt default Ti, at least h;
//                     off without integral action, because only that could take it back.
//   conditional       no integration while u_out differs from u and Ki e drives u further away.
//   A difference within `tolerance` (output deadband, converter resolution) is no windup.
//
// Non-finite inputs give a non-finite u, which the caller must not write. They stay in the integral
// until initialise(). Limits: no set-point weighting on the proportional term, no gain scheduling.
//
// Sources: Åström and Hägglund, Advanced PID Control (2006), ch. 3; Sewdass, thesis (Durban
// University of Technology), ch. 6, for the parallel form.
#pragma once

#include <cstdint>

#include "model/control/tuning.hpp"

namespace loopwarden::control {

enum class Action : std::uint8_t {
  reverse,  // PV up -> output down: e = SP - PV
  direct    // PV up -> output up: e = PV - SP
};

// Returns whether this action with Kp > 0 can control a process with this gain, PV units/CO unit:
// reverse needs a positive one, direct a negative one.
constexpr bool gain_fits(double process_gain, Action action) noexcept {
  return action == Action::reverse ? process_gain > 0.0 : process_gain < 0.0;
}

enum class AntiWindup : std::uint8_t { integral_clamp, back_calculation, conditional };

struct PidSettings {
  PidGains gains;
  Action action = Action::reverse;
  AntiWindup anti_windup = AntiWindup::integral_clamp;
  double tracking_time_s = 0.0;  // s, Tt of back_calculation; 0: Ti
  double output_low = 0.0;       // CO units, the output's range
  double output_high = 100.0;    // CO units
  double tolerance = 0.0;        // CO units

  double output_span() const noexcept { return output_high - output_low; }
  friend bool operator==(const PidSettings&, const PidSettings&) = default;
};

class Pid {
 public:
  Pid(const PidSettings& settings, double period_s) noexcept;

  // New settings take effect without a bump: the integral absorbs the change at the last error.
  void configure(const PidSettings& settings) noexcept;

  // Starts the law so that its next output is `output` plus one period's integral action.
  void initialise(double output, double set_point, double process_variable) noexcept;

  // Steps one period. `output_before` is the output written one period ago, CO units;
  // `extra_rate` is w, CO units/s. Returns u, CO units.
  double step(double set_point, double process_variable, double output_before,
              double extra_rate) noexcept;

  double error(double set_point, double process_variable) const noexcept {
    const double e = set_point - process_variable;
    return settings_.action == Action::reverse ? e : -e;
  }
  // Moves the output by `by`, CO units, for good: the integral takes it over.
  void shift(double by) noexcept {
    integral_ += by;
    calculated_ += by;
  }

  double integral() const noexcept { return integral_; }
  double integral_rate(double error) const noexcept { return settings_.gains.ki * error; }
  const PidSettings& settings() const noexcept { return settings_; }

 private:
  void derive_coefficients() noexcept;
  double windup_rate(double integral_action, double excess) const noexcept;

  PidSettings settings_;
  double period_s_;
  double tracking_rate_ = 0.0;     // 1/s
  double derivative_decay_ = 0.0;  // a
  double integral_ = 0.0;          // CO units
  double derivative_ = 0.0;        // CO units
  double last_error_ = 0.0;        // PV units
  double last_process_variable_ = 0.0;
  double calculated_ = 0.0;  // u one period ago, CO units
};

}  // namespace loopwarden::control
