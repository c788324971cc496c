// SPDX-License-Identifier: Apache-2.0
// Decides whether an explanation gives its name: to an alarm that was raised under another one, and to the incident. One
// rule for both, so that one event never has two names.
//
//   sure      confidence at least kSureName, and kSureClosed of the gap closed (NaN: the confidence decides)
//   stick     the read-back shows that the stem sticks by kStickSeen_percent or more. `learned` then names nothing; while an
//             alarm of a sticking valve is on, only an effect that agrees with such an alarm gives its name
//
// Errors: none.
#pragma once

#include <string_view>

#include "model/monitor/loop_alarms.hpp"
#include "model/monitor/window_measures.hpp"

namespace loopwarden::monitor {

inline constexpr double kSureName = 0.9;
inline constexpr double kSureClosed = 0.8;
inline constexpr double kStickSeen_percent = 1.0;  // of the CO span

// What the read-back shows of a valve since its incident opened.
struct StickSeen {
  bool by_read_back = false;
  bool alarm_on = false;  // stiction, backlash or hysteresis
};

// Returns whether the window's read-back shows that the stem sticks.
constexpr bool shows_stick(const WindowMeasures& measures) noexcept {
  return measures.stick_source == StickSource::read_back &&
         measures.stick_percent >= kStickSeen_percent;
}
// Returns whether an alarm of a sticking valve is active.
bool stick_alarm_on(const LoopAlarms& alarms) noexcept;

// `effect`: empty if none has a name. `gap_closed`: share; NaN: the gap is too near to the noise to say.
bool gives_name(std::string_view effect, double confidence, double gap_closed,
                StickSeen stick) noexcept;

}  // namespace loopwarden::monitor
