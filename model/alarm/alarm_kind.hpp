// SPDX-License-Identifier: Apache-2.0
// The alarms that a loop has.
//
//   valve alarms     one for each valve fault that can be named, one for a valve that is not as it should be in a way that
//                    no specialist knows, and one for a loop that no longer behaves as its twin
//   process alarms   the loop does not do its work: PV, output or mode are not as they should be, or PV is where it
//                    should not be (process_watch.hpp)
//
// A loop has those that are fitted to it: what nothing can tell of, or nobody has given a limit, is no alarm of it.
//
// Source: priorities and suppression by design as in ANSI/ISA-18.2-2016 (IEC 62682), rationalisation and advanced alarming.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The order is that of the register map (a process alarm's bit is its place among them) and never changes.
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
// The first of kAlarmKinds, so that an array of them is indexed by index_of.
inline constexpr auto kValveAlarms = kinds_between<AlarmKind::stiction, AlarmKind::model_gap>();
// The rest of them.
inline constexpr auto kProcessAlarms =
    kinds_between<AlarmKind::bad_pv, AlarmKind::rate_of_change>();
// Of them, those that a limit makes.
inline constexpr auto kLimitAlarms =
    kinds_between<AlarmKind::deviation, AlarmKind::rate_of_change>();
// What a window can show.
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

// Of the process alarms' bit masks.
constexpr unsigned process_bit(AlarmKind kind) noexcept {
  return 1U << (index_of(kind) - kValveAlarmCount);
}

// What no specialist explains has no size either: it is shown as not known, never as 0. Nor has a process alarm one.
constexpr bool has_size(AlarmKind kind) noexcept {
  return kind != AlarmKind::unknown && kind != AlarmKind::model_gap && !is_process_alarm(kind);
}

// How soon somebody has to act: critical within minutes, high within the hour, medium within the shift, low when it suits.
enum class Priority : std::uint8_t { low, medium, high, critical };
constexpr const char* to_text(Priority priority) noexcept {
  return numeric::enum_name<Priority::critical>(priority, {"low", "medium", "high", "critical"});
}

// Where a loop's file says nothing else.
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

// Of what PV is: known as soon as PV is.
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

// Suppression by design: while `cause` is on, `effect` follows from it and is not raised by itself.
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

// By such a cause PV is not known. What is of PV follows from it only until PV is there again, whatever keeps the alarm on.
constexpr bool loses_pv(AlarmKind cause) noexcept {
  return cause == AlarmKind::bad_pv || cause == AlarmKind::source_lost;
}

}  // namespace loopwarden::alarm
