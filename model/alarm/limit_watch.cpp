// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/limit_watch.hpp"

#include <cmath>

#include "model/alarm/limits.hpp"

namespace loopwarden::alarm {

void LimitWatch::add(std::uint64_t period, double sp, double pv, bool automatic) noexcept {
  sp_ = sp;
  pv_ = pv;
  watch_set_point(period, sp, automatic);
  watch_rate(period, pv);
}

void LimitWatch::watch_set_point(std::uint64_t period, double sp, bool automatic) noexcept {
  const double far = Limits::kSetPointMoves * settings_.at(AlarmKind::deviation).limit;
  const bool moves = std::isfinite(sp) && !(std::abs(sp - sp_stood_) <= far);
  if (moves) sp_stood_ = sp;
  if (moves || !automatic || !moved_) moved_ = period;
  rests_ =
      !automatic || static_cast<double>(period - *moved_) * sample_time_s_ < settings_.settle_s;
}

void LimitWatch::watch_rate(std::uint64_t period, double pv) noexcept {
  if (!std::isfinite(pv)) {
    lagged_ = rate_ = kNone;
    return;
  }
  if (std::isfinite(lagged_)) {
    const double step_s = static_cast<double>(period - rate_period_) * sample_time_s_;
    lagged_ = pv + (lagged_ - pv) * std::exp(-step_s / settings_.rate_time_s);
    rate_ = (pv - lagged_) / settings_.rate_time_s;
  } else {
    lagged_ = pv;
    rate_ = 0.0;
  }
  rate_period_ = period;
}

std::optional<bool> LimitWatch::beyond(AlarmKind kind, bool was) const noexcept {
  const Limit& at = settings_.at(kind);
  const auto over = [&](double value, double limit) -> std::optional<bool> {
    if (!std::isfinite(value)) return std::nullopt;
    return value > (was ? limit - at.dead_band : limit);
  };
  switch (kind) {
    case AlarmKind::deviation:
      return rests_ ? std::optional(false) : over(std::abs(sp_ - pv_), at.limit);
    case AlarmKind::pv_high_high:
    case AlarmKind::pv_high: return over(pv_, at.limit);
    case AlarmKind::pv_low:
    case AlarmKind::pv_low_low: return over(-pv_, -at.limit);
    default: return over(std::abs(rate_), at.limit);
  }
}

}  // namespace loopwarden::alarm
