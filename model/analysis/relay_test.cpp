// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/relay_test.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/analysis/limits.hpp"

namespace loopwarden::analysis {
control::PidGains RelayResult::tyreus_luyben() const {
  const double kp = ultimate_gain / 3.2;
  return {.kp = kp, .ki = kp / (2.2 * ultimate_period_s)};
}

control::PidGains RelayResult::ziegler_nichols() const {
  const double kp = 0.45 * ultimate_gain;
  return {.kp = kp, .ki = kp / (ultimate_period_s / 1.2)};
}

double RelayTest::step(double time_s, double pv) {
  const int before = side_;
  if (pv < settings_.target - settings_.hysteresis) side_ = 1;
  if (pv > settings_.target + settings_.hysteresis) side_ = -1;
  if (side_ > before) end_period(time_s);
  if (started_) {
    low_ = std::min(low_, pv);
    high_ = std::max(high_, pv);
  }
  const int sign = settings_.action == control::Action::reverse ? side_ : -side_;
  return settings_.output + sign * settings_.amplitude;
}

void RelayTest::end_period(double time_s) {
  if (started_) {
    const double period_s = time_s - period_began_s_;
    const double amplitude = (high_ - low_) / 2.0;
    ++periods_;
    const auto agrees = [](double a, double b) {
      return std::abs(a - b) <= Limits::kPeriodsAgree * b;
    };
    if (periods_ >= Limits::kFewestPeriods && agrees(period_s, last_period_s_) &&
        agrees(amplitude, last_amplitude_) && amplitude > settings_.hysteresis) {
      const double a = (amplitude + last_amplitude_) / 2.0;
      const double effective = std::sqrt(a * a - settings_.hysteresis * settings_.hysteresis);
      result_ =
          RelayResult{.ultimate_gain = 4.0 * settings_.amplitude / (std::numbers::pi * effective),
                      .ultimate_period_s = (period_s + last_period_s_) / 2.0,
                      .amplitude = a,
                      .periods = periods_};
    }
    last_period_s_ = period_s;
    last_amplitude_ = amplitude;
  }
  started_ = true;
  period_began_s_ = time_s;
  low_ = settings_.target;
  high_ = settings_.target;
}

}  // namespace loopwarden::analysis
