// SPDX-License-Identifier: Apache-2.0
#include "model/control/tuning.hpp"

#include <limits>

namespace loopwarden::control {

PidGains from_isa(const IsaTuning& isa, double pv_span, double co_span) noexcept {
  const double kp = isa.kc * co_span / pv_span;
  return {.kp = kp,
          .ki = kp / isa.ti_s,
          .kd = kp * isa.td_s,
          .derivative_filter_s = isa.derivative_filter_s};
}

IsaTuning to_isa(const PidGains& gains, double pv_span, double co_span) noexcept {
  constexpr double kNoIntegral = std::numeric_limits<double>::infinity();
  return {.kc = gains.kp * pv_span / co_span,
          .ti_s = gains.ki > 0.0 ? gains.kp / gains.ki : kNoIntegral,
          .td_s = gains.kp > 0.0 ? gains.kd / gains.kp : 0.0,
          .derivative_filter_s = gains.derivative_filter_s};
}

}  // namespace loopwarden::control
