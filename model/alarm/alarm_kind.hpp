// SPDX-License-Identifier: Apache-2.0
// The kinds of alarm of a loop.
//
//   valve alarms     one per valve fault with a name, `unknown` for a valve that is faulty in a way
//                    that no specialist recognises, and `model_gap` for a loop that no longer
//                    behaves as its twin
//   process alarms   the loop doesn't do its work: PV, output or mode are wrong, or PV is outside
//                    its range (process_watch.hpp)
//
// A loop has the alarms that are fitted to it: those with a source of evidence and, if they need
// one, a limit.
//
// Source: priorities and suppression by design as in ANSI/ISA-18.2-2016 (IEC 62682),
// rationalisation and advanced alarming.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The order is that of the register map (the bit of a process alarm is its index among them). It
// never changes.
enum class AlarmKind : std::uint8_t {
  stiction,
  backlash,
  hysteresis,
  low_air_supply,
  unknown,
  model_gap,
  bad_pv,
  output_lost,
  output_unknown,
  not_normal_mode,
  enable_open,
  source_lost,
  deviation,
  pv_high_high,
  pv_high,
  pv_low,
  pv_low_low,
  rate_of_change
};

constexpr std::size_t index_of(AlarmKind kind) noexcept { return static_cast<std::size_t>(kind); }

template <AlarmKind first, AlarmKind last>
constexpr auto kinds_between() noexcept {
  std::array<AlarmKind, index_of(last) - index_of(first) + 1> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = static_cast<AlarmKind>(index_of(first) + i);
  }
  return kinds;
}
inline constexpr auto kAlarmKinds = kinds_between<AlarmKind::stiction, AlarmKind::rate_of_change>();
// The first members of kAlarmKinds, so index_of is also the index into an array of them.
inline constexpr auto kValveAlarms = kinds_between<AlarmKind::stiction, AlarmKind::model_gap>();
// The other members.
inline constexpr auto kProcessAlarms =
    kinds_between<AlarmKind::bad_pv, AlarmKind::rate_of_change>();
// The process alarms that have a limit.
inline constexpr auto kLimitAlarms =
    kinds_between<AlarmKind::deviation, AlarmKind::rate_of_change>();
// The alarms that a window can show.
inline constexpr auto kWindowAlarms = kinds_between<AlarmKind::stiction, AlarmKind::unknown>();
inline constexpr std::size_t kAlarmKindCount = kAlarmKinds.size();
inline constexpr std::size_t kValveAlarmCount = kValveAlarms.size();
inline constexpr std::size_t kProcessAlarmCount = kProcessAlarms.size();
static_assert(kValveAlarmCount + kProcessAlarmCount == kAlarmKindCount);

constexpr bool is_process_alarm(AlarmKind kind) noexcept {
  return index_of(kind) >= kValveAlarmCount;
}

constexpr const char* to_text(AlarmKind kind) noexcept {
  return numeric::enum_name<AlarmKind::rate_of_change>(
      kind,
      {"stiction", "backlash", "hysteresis", "low_air_supply", "unknown", "model_gap", "bad_pv",
       "output_lost", "output_unknown", "not_normal_mode", "enable_open", "source_lost",
       "deviation", "pv_high_high", "pv_high", "pv_low", "pv_low_low", "rate_of_change"});
}

// Returns the bit of `kind` in masks of process alarms.
constexpr unsigned process_bit(AlarmKind kind) noexcept {
  return 1U << (index_of(kind) - kValveAlarmCount);
}

// Returns whether the alarm has a size. Faults without a specialist and process alarms have none:
// it is shown as unknown, never as 0.
constexpr bool has_size(AlarmKind kind) noexcept {
  return kind != AlarmKind::unknown && kind != AlarmKind::model_gap && !is_process_alarm(kind);
}

// Time to act: critical within minutes, high within the hour, medium within the shift, low when it
// suits.
enum class Priority : std::uint8_t { low, medium, high, critical };
constexpr const char* to_text(Priority priority) noexcept {
  return numeric::enum_name<Priority::critical>(priority, {"low", "medium", "high", "critical"});
}

// Returns the default priority, for loops whose file sets none.
constexpr Priority usual_priority(AlarmKind kind) noexcept {
  switch (kind) {
    case AlarmKind::output_lost:
    case AlarmKind::pv_high_high:
    case AlarmKind::pv_low_low: return Priority::critical;
    case AlarmKind::low_air_supply:
    case AlarmKind::bad_pv:
    case AlarmKind::output_unknown:
    case AlarmKind::enable_open: return Priority::high;
    case AlarmKind::not_normal_mode:
    case AlarmKind::source_lost:
    case AlarmKind::deviation:
    case AlarmKind::pv_high:
    case AlarmKind::pv_low:
    case AlarmKind::rate_of_change: return Priority::medium;
    default: return Priority::low;
  }
}

// Returns whether the condition depends on PV only. It is valid as soon as PV is valid.
constexpr bool is_of_pv(AlarmKind kind) noexcept {
  switch (kind) {
    case AlarmKind::deviation:
    case AlarmKind::pv_high_high:
    case AlarmKind::pv_high:
    case AlarmKind::pv_low:
    case AlarmKind::pv_low_low:
    case AlarmKind::rate_of_change: return true;
    default: return false;
  }
}

// Returns whether `cause` suppresses `effect` while it is on (suppression by design).
constexpr bool follows(AlarmKind effect, AlarmKind cause) noexcept {
  const auto is = [effect](auto... kinds) { return ((effect == kinds) || ...); };
  using K = AlarmKind;
  const bool of_pv = is_of_pv(effect);
  switch (cause) {
    case K::low_air_supply: return !is_process_alarm(effect) && effect != cause;
    case K::source_lost: return of_pv || is(K::bad_pv, K::output_unknown, K::not_normal_mode);
    case K::bad_pv: return of_pv || is(K::not_normal_mode);
    case K::output_lost: return is(K::output_unknown, K::not_normal_mode, K::deviation);
    case K::output_unknown:
    case K::enable_open: return is(K::not_normal_mode, K::deviation);
    case K::pv_high_high: return is(K::pv_high);
    case K::pv_low_low: return is(K::pv_low);
    default: return false;
  }
}

// Returns whether PV is not valid during `cause`. Alarms of PV follow from such a cause only until
// PV is valid again, even if the cause stays on.
constexpr bool loses_pv(AlarmKind cause) noexcept {
  return cause == AlarmKind::bad_pv || cause == AlarmKind::source_lost;
}

}  // namespace loopwarden::alarm
