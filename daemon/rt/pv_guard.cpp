// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/pv_guard.hpp"

#include <cmath>
#include <utility>

namespace loopwarden::daemon::rt {
namespace {
constexpr double kNanosecondsPerSecond = 1e9;
constexpr double kMovedShare = 0.02;  // of the output's span: less is no movement

hal::Sample bad(hal::Sample sample, hal::Reason reason) noexcept {
  sample.quality = hal::Quality::bad;
  sample.reason = reason;
  return sample;
}
}  // namespace

bool PvGuard::frozen(const hal::Sample& sample, double output, double output_span,
                     std::int64_t now_ns) noexcept {
  if (std::exchange(blind_, false)) {
    still_since_ns_ += now_ns - blind_since_ns_;
    output_then_ += output - output_when_blind_;
  }
  if (!std::exchange(seen_, true) || sample.value != still_value_) {
    still_value_ = sample.value;
    still_since_ns_ = now_ns;
    output_then_ = output;
    return false;
  }
  const double still_s = static_cast<double>(now_ns - still_since_ns_) / kNanosecondsPerSecond;
  return settings_.frozen_after_s > 0.0 && still_s > settings_.frozen_after_s &&
         std::abs(output - output_then_) > kMovedShare * output_span;
}

hal::Sample PvGuard::check(hal::Sample sample, double output, double output_span,
                           std::int64_t now_ns) noexcept {
  // What the backend holds stands still because there is nothing to look at.
  const bool held = sample.quality == hal::Quality::uncertain;
  sample = judged(sample, output, output_span, now_ns);
  if ((held || sample.quality == hal::Quality::bad) && !std::exchange(blind_, true)) {
    blind_since_ns_ = now_ns;
    output_when_blind_ = output;
  }
  return sample;
}

void PvGuard::output_learned(double difference) noexcept {
  if (!blind_) output_then_ += difference;  // else it counts once PV is seen again
}

hal::Sample PvGuard::judged(hal::Sample sample, double output, double output_span,
                            std::int64_t now_ns) noexcept {
  if (sample.quality == hal::Quality::bad) return sample;
  if (static_cast<double>(now_ns - sample.time_ns) > settings_.max_age_s * kNanosecondsPerSecond) {
    return bad(sample, hal::Reason::stale);
  }
  if (!std::isfinite(sample.value)) return bad(sample, hal::Reason::not_finite);
  const double margin = settings_.range_margin * (settings_.high - settings_.low);
  if (sample.value < settings_.low - margin || sample.value > settings_.high + margin) {
    return bad(sample, hal::Reason::out_of_range);
  }
  if (sample.quality == hal::Quality::good && frozen(sample, output, output_span, now_ns)) {
    sample.quality = hal::Quality::uncertain;
    sample.reason = hal::Reason::frozen;
  }
  return sample;
}

}  // namespace loopwarden::daemon::rt
