// SPDX-License-Identifier: Apache-2.0
#include "model/control/pid.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

Pid::Pid(const PidSettings& settings, double period_s) noexcept
    : settings_(settings), period_s_(period_s) {
  derive_coefficients();
}

void Pid::derive_coefficients() noexcept {
  const PidGains& gains = settings_.gains;
  double tracking_time_s = settings_.tracking_time_s;
  if (tracking_time_s <= 0.0 && gains.ki > 0.0) tracking_time_s = gains.kp / gains.ki;
  tracking_rate_ = gains.ki > 0.0 ? 1.0 / std::max(tracking_time_s, period_s_) : 0.0;
  derivative_decay_ =
      gains.derivative_filter_s > 0.0 ? std::exp(-period_s_ / gains.derivative_filter_s) : 0.0;
}

void Pid::configure(const PidSettings& settings) noexcept {
  // The last output does not change: the integral takes over the change of the other two terms.
  // The derivative continues at its new gain, so that the next sample of a moving PV gives no kick.
  const double side = settings.action == settings_.action ? 1.0 : -1.0;
  const double error = side * last_error_;
  const double kd = settings_.gains.kd;
  const double derivative = kd > 0.0 ? side * derivative_ * (settings.gains.kd / kd) : 0.0;
  integral_ += settings_.gains.kp * last_error_ - settings.gains.kp * error;
  integral_ += derivative_ - derivative;
  derivative_ = derivative;
  last_error_ = error;
  settings_ = settings;
  derive_coefficients();
}

void Pid::initialise(double output, double set_point, double process_variable) noexcept {
  last_error_ = error(set_point, process_variable);
  last_process_variable_ = process_variable;
  derivative_ = 0.0;
  integral_ = output - settings_.gains.kp * last_error_;
  calculated_ = output;
}

double Pid::windup_rate(double integral_action, double excess) const noexcept {
  // `excess`: calculated output minus the output written, CO units.
  if (std::abs(excess) <= settings_.tolerance) return integral_action;
  switch (settings_.anti_windup) {
    case AntiWindup::back_calculation: return integral_action - excess * tracking_rate_;
    case AntiWindup::conditional: return integral_action * excess > 0.0 ? 0.0 : integral_action;
    case AntiWindup::integral_clamp: break;
  }
  return integral_action;
}

double Pid::step(double set_point, double process_variable, double output_before,
                 double extra_rate) noexcept {
  const PidGains& gains = settings_.gains;
  const double e = error(set_point, process_variable);

  const double before = integral_;
  const double rate = windup_rate(gains.ki * e, calculated_ - output_before) + extra_rate;
  integral_ += rate * period_s_;
  if (settings_.anti_windup == AntiWindup::integral_clamp) {
    const double span = settings_.output_span();
    integral_ = std::clamp(integral_, std::min(-span, before), std::max(span, before));
  }

  if (gains.kd > 0.0) {
    const double slope = (process_variable - last_process_variable_) / period_s_;
    const double opposing = settings_.action == Action::reverse ? -slope : slope;
    derivative_ = derivative_decay_ * derivative_ + (1.0 - derivative_decay_) * gains.kd * opposing;
  }

  last_error_ = e;
  last_process_variable_ = process_variable;
  calculated_ = gains.kp * e + integral_ + derivative_;
  return calculated_;
}

}  // namespace loopwarden::control
