// SPDX-License-Identifier: Apache-2.0
// Decides whether an explanation names an alarm that was raised under another name, and the
// incident. Both use the same rule, so one event never has two names.
//
//   sure      confidence at least kSureName, and kSureClosed of the gap closed (NaN: the confidence
//             decides)
//   refuted   `learned`, if the read-back shows that the stem sticks by kStickSeen_percent or more
//
// No errors.
#pragma once

#include <string_view>

#include "model/alarm/window_measures.hpp"

namespace loopwarden::alarm {

inline constexpr double kSureName = 0.9;
inline constexpr double kSureClosed = 0.8;
inline constexpr double kStickSeen_percent = 1.0;  // of the CO span

// Returns whether the window's read-back shows that the stem sticks.
constexpr bool shows_stick(const WindowMeasures& measures) noexcept {
  return measures.stick_source == StickSource::read_back &&
         measures.stick_percent >= kStickSeen_percent;
}

// Returns whether the read-back contradicts a name. `stick_seen`: since the incident opened.
constexpr bool refuted(std::string_view effect, bool stick_seen) noexcept {
  return stick_seen && effect == "learned";
}

// Returns whether the explanation gives its name. `effect`: empty without a name. `gap_closed`:
// share; NaN: too near to the noise.
constexpr bool gives_name(std::string_view effect, double confidence, double gap_closed,
                          bool stick_seen) noexcept {
  return !effect.empty() && confidence >= kSureName && !(gap_closed < kSureClosed) &&
         !refuted(effect, stick_seen);
}

}  // namespace loopwarden::alarm
