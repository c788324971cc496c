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

#include "model/alarm/limits.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::alarm {

// Returns whether the window's read-back shows that the stem sticks.
constexpr bool shows_stick(const WindowMeasures& measures) noexcept {
  return measures.stick_source == StickSource::read_back &&
         measures.stick_percent >= Limits::kStickSeen_percent;
}

// Returns whether the read-back contradicts a name. `stick_seen`: since the incident opened.
constexpr bool refuted(std::string_view effect, bool stick_seen) noexcept {
  return stick_seen && effect == "learned";
}

// Returns whether the explanation gives its name. `effect`: empty without a name. `gap_closed`:
// share; NaN: too near to the noise.
constexpr bool gives_name(std::string_view effect, double confidence, double gap_closed,
                          bool stick_seen) noexcept {
  return !effect.empty() && confidence >= Limits::kSureName &&
         !(gap_closed < Limits::kSureClosed) && !refuted(effect, stick_seen);
}

}  // namespace loopwarden::alarm
