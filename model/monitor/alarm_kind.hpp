// SPDX-License-Identifier: Apache-2.0
// The alarms that a loop has: one for each valve fault that can be named, one for a valve that is not as it should be in
// a way that no specialist knows, and one for a loop that no longer behaves as its twin.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace loopwarden::monitor {

// The order is that of the register map and never changes.
enum class AlarmKind : std::uint8_t {
  stiction,
  backlash,
  hysteresis,
  low_air_supply,
  unknown,
  model_gap
};

inline constexpr std::array kAlarmKinds{AlarmKind::stiction,   AlarmKind::backlash,
                                        AlarmKind::hysteresis, AlarmKind::low_air_supply,
                                        AlarmKind::unknown,    AlarmKind::model_gap};
// What a window can show.
inline constexpr std::array kWindowAlarms{AlarmKind::stiction, AlarmKind::backlash,
                                          AlarmKind::hysteresis, AlarmKind::low_air_supply,
                                          AlarmKind::unknown};
inline constexpr std::size_t kAlarmKindCount = kAlarmKinds.size();

constexpr std::size_t index_of(AlarmKind kind) noexcept { return static_cast<std::size_t>(kind); }

constexpr const char* to_text(AlarmKind kind) noexcept {
  switch (kind) {
    case AlarmKind::stiction: return "stiction";
    case AlarmKind::backlash: return "backlash";
    case AlarmKind::hysteresis: return "hysteresis";
    case AlarmKind::low_air_supply: return "low_air_supply";
    case AlarmKind::unknown: return "unknown";
    case AlarmKind::model_gap: break;
  }
  return "model_gap";
}

// What no specialist explains has no size either: it is shown as not known, never as 0.
constexpr bool has_size(AlarmKind kind) noexcept {
  return kind != AlarmKind::unknown && kind != AlarmKind::model_gap;
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
          "plan the valve's repair; until then the jacket or a slower controller calms the loop"};
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
    case AlarmKind::model_gap: break;
  }
  return {
      "the loop no longer behaves as when it was commissioned: valve, process, transmitter or load",
      "its tuning may not fit any more, and the specialists know another loop",
      "find what has changed before the loop is tuned anew: the explanation by the twin names it; "
      "without one, check valve, transmitter and load"};
}

}  // namespace loopwarden::monitor
