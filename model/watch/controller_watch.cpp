// SPDX-License-Identifier: Apache-2.0
#include "model/watch/controller_watch.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/text.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::watch {
namespace {

double resolution_of(const plant::SeenController& seen, double co_span) {
  return std::max(seen.resolution, Limits::kFinest * co_span);
}

control::PidSettings tolerant(const plant::LoopModel& twin) {
  control::PidSettings settings = twin.controller.pid;
  // The rounding of a converter is no windup.
  if (twin.twin && twin.twin->controller) {
    settings.tolerance = std::max(settings.tolerance, twin.twin->controller->resolution);
  }
  return settings;
}

control::PidSettings higher(control::PidSettings settings) {
  settings.gains.kp *= Limits::kQuarterHigher;
  settings.gains.ki *= Limits::kQuarterHigher;
  settings.gains.kd *= Limits::kQuarterHigher;
  return settings;
}

// Returns the law's output within the range, and moves its integral towards the measured CO.
double follow(control::Pid& law, double sp, double pv, double last_co, double co, double share) {
  const control::PidSettings& s = law.settings();
  const double u = std::clamp(law.step(sp, pv, last_co, 0.0), s.output_low, s.output_high);
  law.shift(share * (co - u));
  return u;
}

}  // namespace

bool ControllerWatch::can_watch(const plant::SeenController& seen, double co_span) noexcept {
  return seen.rms <= Limits::kWithin * resolution_of(seen, co_span);
}

ControllerWatch::ControllerWatch(const plant::LoopModel& twin)
    : law_(tolerant(twin), twin.sample_time_s),
      other_(higher(tolerant(twin)), twin.sample_time_s),
      seen_(twin.twin ? twin.twin->controller : std::nullopt),
      co_span_(twin.controller.pid.output_span()),
      sample_time_s_(twin.sample_time_s),
      watched_(seen_ && can_watch(*seen_, co_span_)) {
  const double answer = std::max(plant::answer_s(twin) / sample_time_s_, 2.0);  // samples
  follow_ = 1.0 / answer;
  const double rounding = resolution_of(seen_.value_or(plant::SeenController{}), co_span_);
  const double rms = seen_ ? seen_->rms : 0.0;
  noise2_ = std::max(rms * rms, 2.0 * rounding * rounding / 12.0);
  block_ = std::max(Limits::kFewestInBlock,
                    static_cast<std::size_t>(std::lround(Limits::kBlockAnswers * answer)));
  most_quiet_ = static_cast<std::size_t>(Limits::kQuiet_s / sample_time_s_);
}

void ControllerWatch::add(double sp, double pv, double co) noexcept {
  ++untested_;
  if (!(std::isfinite(sp) && std::isfinite(pv) && std::isfinite(co))) {
    restart();
    return;
  }
  if (!started_) {
    law_.initialise(co, sp, pv);
    other_.initialise(co, sp, pv);
    last_co_ = co;
    squares_ = other_squares_ = 0.0;
    in_block_ = 0;
    started_ = true;
    return;
  }
  const double u = follow(law_, sp, pv, last_co_, co, follow_);
  const double other = follow(other_, sp, pv, last_co_, co, follow_);
  last_co_ = co;
  apart_ = co - u;
  squares_ += apart_ * apart_;
  other_squares_ += (other - u) * (other - u);
  if (++in_block_ == block_) end_block();
}

void ControllerWatch::end_block() noexcept {
  const double samples = static_cast<double>(block_) * noise2_;
  size_ = squares_ / samples;
  if (other_squares_ / samples >= Limits::kLimit) {
    untested_ = 0;
    tested_ = true;
  }
  sum_ = std::clamp(sum_ + std::min(size_ - Limits::kLimit, Limits::kMostInBlock), 0.0,
                    2.0 * Limits::kControllerAlarm);
  if (watched_ && sum_ >= Limits::kControllerAlarm) on_ = true;
  quiet_samples_ =
      sum_ < Limits::kQuietShare * Limits::kControllerAlarm ? quiet_samples_ + block_ : 0;
  if (quiet_samples_ >= most_quiet_) on_ = false;
  squares_ = other_squares_ = 0.0;
  in_block_ = 0;
}

std::string ControllerWatch::why_not() const {
  if (watched_) return "";
  if (!seen_)
    return "the twin's healthy record does not show the controller: commission the loop again";
  return numeric::text(
      "CO of the healthy record differs from the controller's result by %.2g of its span, and %.2g "
      "is allowed: CO has other inputs (feed-forward, tracking, override), or the settings are "
      "unknown",
      seen_->rms / co_span_, Limits::kWithin * resolution_of(*seen_, co_span_) / co_span_);
}

double ControllerWatch::untested_s() const noexcept {
  return static_cast<double>(untested_) * sample_time_s_;
}

}  // namespace loopwarden::watch
