// SPDX-License-Identifier: Apache-2.0
// The alarms that a loop has.
//
//   valve alarms     one for each valve fault that can be named, one for a valve that is not as it should be in a way that
//                    no specialist knows, and one for a loop that no longer behaves as its twin
//   process alarms   the loop does not do its work: PV, output or mode are not as they should be (process_watch.hpp)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::monitor {

// The order is that of the register map, which has the valve alarms, and never changes.
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
  not_normal_mode
};

inline constexpr std::array kAlarmKinds{AlarmKind::stiction,       AlarmKind::backlash,
                                        AlarmKind::hysteresis,     AlarmKind::low_air_supply,
                                        AlarmKind::unknown,        AlarmKind::model_gap,
                                        AlarmKind::bad_pv,         AlarmKind::output_lost,
                                        AlarmKind::output_unknown, AlarmKind::not_normal_mode};
// The first of kAlarmKinds, so that an array of them is indexed by index_of.
inline constexpr std::array kValveAlarms{AlarmKind::stiction,   AlarmKind::backlash,
                                         AlarmKind::hysteresis, AlarmKind::low_air_supply,
                                         AlarmKind::unknown,    AlarmKind::model_gap};
// The rest of them.
inline constexpr std::array kProcessAlarms{AlarmKind::bad_pv, AlarmKind::output_lost,
                                           AlarmKind::output_unknown, AlarmKind::not_normal_mode};
// What a window can show.
inline constexpr std::array kWindowAlarms{AlarmKind::stiction, AlarmKind::backlash,
                                          AlarmKind::hysteresis, AlarmKind::low_air_supply,
                                          AlarmKind::unknown};
inline constexpr std::size_t kAlarmKindCount = kAlarmKinds.size();
inline constexpr std::size_t kValveAlarmCount = kValveAlarms.size();
inline constexpr std::size_t kProcessAlarmCount = kProcessAlarms.size();
static_assert(kValveAlarmCount + kProcessAlarmCount == kAlarmKindCount);

constexpr std::size_t index_of(AlarmKind kind) noexcept { return static_cast<std::size_t>(kind); }

constexpr bool is_process_alarm(AlarmKind kind) noexcept {
  return index_of(kind) >= kValveAlarmCount;
}

constexpr const char* to_text(AlarmKind kind) noexcept {
  return numeric::enum_name<AlarmKind::not_normal_mode>(
      kind, {"stiction", "backlash", "hysteresis", "low_air_supply", "unknown", "model_gap",
             "bad_pv", "output_lost", "output_unknown", "not_normal_mode"});
}

// What no specialist explains has no size either: it is shown as not known, never as 0. Nor has a process alarm one.
constexpr bool has_size(AlarmKind kind) noexcept {
  return kind != AlarmKind::unknown && kind != AlarmKind::model_gap && !is_process_alarm(kind);
}

// Whatever its size, it is looked after at once: the loop does not control, or its other alarms wait for it.
constexpr bool acts_now(AlarmKind kind) noexcept {
  return kind == AlarmKind::low_air_supply ||
         (is_process_alarm(kind) && kind != AlarmKind::not_normal_mode);
}

// What an operator is told with the alarm: an alarm without an action is none.
struct AlarmGuide {
  const char* cause;
  const char* consequence;
  const char* action;
};

constexpr AlarmGuide guide_of(AlarmKind kind) noexcept {
  switch (kind) {
    case AlarmKind::stiction:
      return {
          "the stem sticks and jumps: packing too tight, deposits, a worn seat",
          "the loop cycles around its set point and wears the valve",
          "plan the valve's repair; until then planned moves or a slower controller calm the loop"};
    case AlarmKind::backlash:
      return {"play between stem and plug or in the linkage",
              "the valve answers late after each reversal; the loop may cycle slowly",
              "have linkage and stem connection checked at the next stop"};
    case AlarmKind::hysteresis:
      return {"friction or a worn diaphragm: the valve stands elsewhere going up than coming down",
              "the flow differs with the direction of travel",
              "check packing, diaphragm and positioner calibration at the next stop"};
    case AlarmKind::low_air_supply:
      return {"the actuator gets too little air: regulator, filter, leak, compressor",
              "the valve moves slowly and does not reach its full travel",
              "check the supply pressure at the valve now; other alarms of this valve wait for it"};
    case AlarmKind::unknown:
      return {"the valve does not answer as a healthy one, nor as any fault that is known here",
              "the loop's quality is not assured",
              "look at the trend; compare with `loopwarden gap` or `loopwarden diagnose`"};
    case AlarmKind::model_gap:
      return {
          "the loop no longer behaves as when it was commissioned: valve, process, transmitter or "
          "load",
          "its tuning may not fit any more, and the specialists know another loop",
          "find what has changed before the loop is tuned anew: the explanation by the twin names "
          "it; without one, check valve, transmitter and load"};
    case AlarmKind::bad_pv:
      return {
          "PV can't be used: its transmitter, its wiring or the link to it has failed; the "
          "journal's line has the reason",
          "the loop can't control; the output does what `safe_actions.bad_pv` says",
          "watch the process by another measurement; check transmitter, wiring and link"};
    case AlarmKind::output_lost:
      return {"commands don't reach the valve: the device, its power or the link to it has failed",
              "nobody moves the valve; the device's own watchdog may have moved it",
              "look at the valve; check the device, its power and the link"};
    case AlarmKind::output_unknown:
      return {"nothing tells where the output stands: there is no read-back, or it is bad",
              "the loop writes nothing to the valve, whatever its mode",
              "set the output by hand (`loopwarden set --mode man --output`), or mend the "
              "read-back"};
    case AlarmKind::not_normal_mode: break;
  }
  return {"an operator, a master or a fault has taken the loop out of its normal mode",
          "in manual or fallback the valve stays where it is, and nothing controls PV",
          "find out why; put the loop back into its normal mode once nothing speaks against it"};
}

}  // namespace loopwarden::monitor
