// SPDX-License-Identifier: Apache-2.0
#include "daemon/external/watch_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "daemon/rt/command.hpp"
#include "record/record_row.hpp"

namespace loopwarden::daemon::external {

using control::Fault;
using control::Mode;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Returns the value, or NaN if it is unknown.
double known(const hal::Sample& sample) noexcept {
  return sample.quality != hal::Quality::bad ? sample.value : kNone;
}

}  // namespace

WatchCycle::WatchCycle(std::uint32_t loop, const rt::LoopSettings& settings, Wiring wiring,
                       hal::LoopSource& source, rt::LoopChannels& channels,
                       base::SpscRing<rt::Event>& events)
    : loop_(loop),
      settings_(settings),
      wiring_(std::move(wiring)),
      source_(source),
      channels_(channels),
      events_(events),
      pv_guard_(settings.pv_check) {}

void WatchCycle::take_settings() noexcept {
  if (!channels_.settings.fetch(offer_)) return;
  if (!offer_.withdrawn) {
    settings_ = offer_.settings;
    pv_guard_.configure(settings_.pv_check);
    channels_.in_force.publish(settings_);
    channels_.settings_taken.store(offer_.number, std::memory_order_release);
    event(rt::EventCode::settings_applied, 0, 0, 0.0);
  }
  channels_.settings_waiting.store(0, std::memory_order_release);
}

double WatchCycle::age_ns(const hal::SourceSample& value) const noexcept {
  return static_cast<double>(now_ns_ - std::max(value.sample.time_ns, value.alive_ns));
}

hal::Sample WatchCycle::fresh(const hal::SourceSample& value) const noexcept {
  hal::Sample sample = value.sample;
  if (sample.quality != hal::Quality::bad && age_ns(value) > settings_.pv_check.max_age_s * 1e9) {
    sample.quality = hal::Quality::bad;
    sample.reason = hal::Reason::stale;
  }
  return sample;
}

hal::Sample WatchCycle::as_output(const hal::SourceSample& value) const noexcept {
  return rt::checked_as_output(fresh(value), settings_.pv_check, settings_.controller.pid);
}

hal::Sample WatchCycle::checked_pv(const hal::SourceSample& pv, double co, Mode mode) noexcept {
  const control::PidSettings& pid = settings_.controller.pid;
  hal::Sample judged = pv.sample;
  const double held_ns = static_cast<double>(now_ns_ - pv.sample.time_ns);
  const double most_ns = settings_.pv_check.max_held_s * 1e9;
  if (most_ns == 0.0 || held_ns <= most_ns) {
    judged.time_ns = std::max(judged.time_ns, pv.alive_ns);
  }
  judged = pv_guard_.check(
      judged,
      {.value = co, .span = pid.output_high - pid.output_low, .automatic = mode == Mode::automatic},
      now_ns_);
  judged.time_ns = pv.sample.time_ns;
  const double age = static_cast<double>(now_ns_ - judged.time_ns);
  if (judged.quality == hal::Quality::good && age > settings_.pv_check.max_age_s * 1e9) {
    judged.reason = hal::Reason::held;
  }
  return judged;
}

Mode WatchCycle::mode_now() const noexcept {
  if (!wiring_.mode) return Mode::automatic;
  const double number = known(fresh(inputs_.mode));
  if (!std::isfinite(number)) return Mode::fallback;
  if (hal::holds(wiring_.mode_values.automatic, number)) return Mode::automatic;
  return hal::holds(wiring_.mode_values.manual, number) ? Mode::manual : Mode::fallback;
}

void WatchCycle::run(const hal::CycleTime& time, std::uint64_t missed) noexcept {
  now_ns_ = time.now_ns;
  take_settings();
  source_.read(inputs_);
  const hal::Sample output = as_output(inputs_.output);
  const double co = known(output);
  const Mode mode = mode_now();
  if (mode != Mode::fallback) last_mode_ = mode;
  const hal::Sample pv = checked_pv(inputs_.process_variable, co, mode);
  const double sp = wiring_.set_point
                        ? known(rt::checked_as_pv(fresh(inputs_.set_point), settings_.pv_check))
                        : kNone;
  const bool pv_bad = pv.quality == hal::Quality::bad;
  const Fault fault = pv_bad || pv.reason == hal::Reason::frozen ? Fault::bad_pv
                      : !std::isfinite(co)                       ? Fault::output_unknown
                                                                 : Fault::none;

  const control::PidSettings& pid = settings_.controller.pid;
  const auto flag = [](bool set, unsigned bit) { return set ? bit : 0U; };
  const record::RecordRow row{
      .time_ns = time.now_ns,
      .period_index = time.period_index,
      .sp = sp,
      .pv = pv_bad ? kNone : pv.value,
      .co = co,
      .stem = wiring_.stem ? known(as_output(inputs_.stem)) : kNone,
      .calculated = static_cast<float>(co),
      .mode = mode,
      .fault = fault,
      .pv_quality = pv.quality,
      .pv_reason = pv.reason,
      .flags = static_cast<std::uint8_t>(flag(co <= pid.output_low, record::kAtLow) |
                                         flag(co >= pid.output_high, record::kAtHigh) |
                                         flag(missed > 0, record::kLateCycle)),
      .requested_mode = last_mode_,
      .age_ms = static_cast<float>(static_cast<double>(time.now_ns - pv.time_ns) / 1e6)};
  channels_.records.try_push(row);
  channels_.watched.try_push(row);
  const hal::Sample& stem = inputs_.stem.sample;
  channels_.position_age_ms.store(
      wiring_.stem && stem.sequence > 0
          ? static_cast<float>(static_cast<double>(time.now_ns - stem.time_ns) / 1e6)
          : -1.0F,
      std::memory_order_relaxed);
  channels_.set_point_wanted.store(sp, std::memory_order_relaxed);
  channels_.availability.store(rt::packed({.mode = last_mode_, .output_known = std::isfinite(co)}),
                               std::memory_order_release);
  report(fault, fault == Fault::output_unknown ? output.reason : pv.reason, mode, co);
}

void WatchCycle::report(Fault fault, hal::Reason reason, Mode mode, double co) noexcept {
  if (fault != reported_fault_) {
    reported_fault_ = fault;
    event(rt::EventCode::fault_changed, static_cast<std::uint8_t>(fault),
          static_cast<std::uint8_t>(reason), co);
  }
  if (mode != reported_mode_) {
    reported_mode_ = mode;
    event(rt::EventCode::mode_changed, static_cast<std::uint8_t>(mode), 0, co);
  }
}

void WatchCycle::event(rt::EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept {
  events_.try_push(
      {.time_ns = now_ns_, .loop = loop_, .code = code, .a = a, .b = b, .value = value});
}

}  // namespace loopwarden::daemon::external
