// SPDX-License-Identifier: Apache-2.0
#include "model/plant/process.hpp"

#include <cmath>

namespace loopwarden::plant {

const char* to_text(ProcessKind kind) noexcept {
  return kind == ProcessKind::integrating ? "integrating" : "self_regulating";
}

Process::Process(const ProcessParameters& parameters, double period_s)
    : gain_(parameters.gain),
      integrating_(parameters.integrating()),
      second_(parameters.second_time_constant_s > 0.0),
      keep_(integrating_ ? 1.0 : std::exp(-period_s / parameters.time_constant_s)),
      whole_(static_cast<std::size_t>(parameters.dead_time_s / period_s)),
      line_(whole_ + 2) {
  const double fraction = parameters.dead_time_s / period_s - static_cast<double>(whole_);
  if (integrating_) {
    early_ = fraction * period_s * gain_;
    late_ = (1.0 - fraction) * period_s * gain_;
  } else {
    const double after = std::exp(-(1.0 - fraction) * period_s / parameters.time_constant_s);
    early_ = (after - keep_) * gain_;
    late_ = (1.0 - after) * gain_;
  }
  if (!second_) return;
  double lag_s = parameters.second_time_constant_s;
  if (!integrating_) {
    const double first_s = parameters.time_constant_s;
    constexpr double kApart = 1e-3;
    if (std::abs(lag_s - first_s) < kApart * first_s) lag_s = (1.0 - kApart) * first_s;
    share_ = first_s / (first_s - lag_s);
    lag_share_ = lag_s / (first_s - lag_s);
  } else {
    lag_share_ = lag_s;
  }
  lag_keep_ = std::exp(-period_s / lag_s);
  const double after = std::exp(-(1.0 - fraction) * period_s / lag_s);
  lag_early_ = (after - lag_keep_) * gain_;
  lag_late_ = (1.0 - after) * gain_;
}

double Process::reset(double u, double level) noexcept {
  balance_ = integrating_ ? u : 0.0;
  level_ = level;
  line_.fill(u - balance_);
  first_ = lag_ = gain_ * (u - balance_);
  return level_ + share_ * first_ - lag_share_ * lag_;
}

}  // namespace loopwarden::plant
