// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/pv_guard.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace loopwarden::daemon::rt {
namespace {
constexpr double kNanosecondsPerSecond = 1e9;

hal::Sample bad(hal::Sample sample, hal::Reason reason) noexcept {
  sample.quality = hal::Quality::bad;
  sample.reason = reason;
  return sample;
}

double seconds(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  return static_cast<double>(to_ns - from_ns) / kNanosecondsPerSecond;
}
}  // namespace

hal::Sample in_range(hal::Sample sample, double low, double high, double margin) noexcept {
  if (sample.quality == hal::Quality::bad) return sample;
  if (!std::isfinite(sample.value)) return bad(sample, hal::Reason::not_finite);
  const double beyond = margin * (high - low);
  const bool inside = sample.value >= low - beyond && sample.value <= high + beyond;
  return inside ? sample : bad(sample, hal::Reason::out_of_range);
}

hal::Sample checked_as_pv(hal::Sample sample, const hal::PvCheckSettings& pv) noexcept {
  return in_range(sample, pv.low, pv.high, pv.range_margin);
}

hal::Sample checked_as_output(hal::Sample sample, const hal::PvCheckSettings& pv,
                              const control::PidSettings& pid) noexcept {
  return in_range(sample, pid.output_low, pid.output_high,
                  std::max(pv.range_margin, kOutputMargin));
}

bool PvGuard::at_end(const hal::Sample& sample) const noexcept {
  const double near = kAtEnd * (settings_.high - settings_.low);
  return sample.limit != hal::Limit::none || sample.value <= settings_.low + near ||
         sample.value >= settings_.high - near;
}

void PvGuard::changed(double value, std::int64_t now_ns) noexcept {
  if (seen_ && !frozen_) {
    usual_rest_s_ = std::max(seconds(still_since_ns_, now_ns), kForget * usual_rest_s_);
  }
  seen_ = true;
  frozen_ = false;
  still_value_ = value;
  still_since_ns_ = now_ns;
}

void PvGuard::forget_movement(double output) noexcept {
  lowest_ = highest_ = output;
  moved_ = false;
}

double PvGuard::wait_s() const noexcept {
  return std::max(settings_.frozen_after_s, std::min(kRests * usual_rest_s_, kLongestWait_s));
}

bool PvGuard::frozen(const hal::Sample& sample, const Output& output,
                     std::int64_t now_ns) noexcept {
  if (std::exchange(blind_, false)) {
    const std::int64_t blind_ns = now_ns - blind_since_ns_;
    still_since_ns_ += blind_ns;
    moved_at_ns_ += blind_ns;
    lowest_ += output.value - output_when_blind_;
    highest_ += output.value - output_when_blind_;
  }
  const bool repeats = seen_ && sample.value == still_value_;
  if (!repeats) changed(sample.value, now_ns);
  if (!repeats || !output.automatic || at_end(sample)) {
    forget_movement(output.value);
    return frozen_;
  }
  lowest_ = std::fmin(lowest_, output.value);
  highest_ = std::fmax(highest_, output.value);
  if (!moved_ && highest_ - lowest_ >= kFrozenMove * output.span) {
    moved_ = true;
    moved_at_ns_ = now_ns;
  }
  frozen_ = frozen_ || (moved_ && seconds(moved_at_ns_, now_ns) > wait_s());
  return frozen_;
}

hal::Sample PvGuard::check(hal::Sample sample, const Output& output, std::int64_t now_ns) noexcept {
  // The backend repeats a held value because it has no newer one.
  const bool held = sample.quality == hal::Quality::uncertain;
  sample = judged(sample, output, now_ns);
  if ((held || sample.quality == hal::Quality::bad) && !std::exchange(blind_, true)) {
    blind_since_ns_ = now_ns;
    output_when_blind_ = output.value;
  }
  return sample;
}

void PvGuard::output_learned(double difference) noexcept {
  if (blind_) return;  // counts when PV is measured again
  lowest_ += difference;
  highest_ += difference;
}

hal::Sample PvGuard::judged(hal::Sample sample, const Output& output,
                            std::int64_t now_ns) noexcept {
  if (sample.quality == hal::Quality::bad) return sample;
  if (seconds(sample.time_ns, now_ns) > settings_.max_age_s) {
    return bad(sample, hal::Reason::stale);
  }
  sample = checked_as_pv(sample, settings_);
  if (sample.quality != hal::Quality::good || settings_.frozen_after_s <= 0.0) return sample;
  if (frozen(sample, output, now_ns)) {
    sample.quality = hal::Quality::uncertain;
    sample.reason = hal::Reason::frozen;
  }
  return sample;
}

}  // namespace loopwarden::daemon::rt
