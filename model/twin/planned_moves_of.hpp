// SPDX-License-Identifier: Apache-2.0
// Settings of planned moves (model/control/planned_moves.hpp) from what is known of a loop that
// sticks: process and load from its twin, s and j from what explains its alarm.
//
// A second lag T2 counts half as lag and half as dead time.
//
// Errors: none; where the process integrates there are no settings.
// Not of a valve that a record can't tell from one with play: planned moves would hunt in it.
// What it can't do: a gain that changes with the opening is that of the twin's process.
//
// Source of the half rule: Skogestad, J. Process Control 13 (2003) 291-309.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/control/planned_moves_settings.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

// Of a valve, CO units; an interval that is not known is {0, 0}.
struct Stick {
  double s = 0.0;
  double j = 0.0;
  std::array<double, 2> s_interval{};
  std::array<double, 2> j_interval{};
  double confidence = 0.0;  // that it is stiction, 0 to 1
};
inline constexpr double kLeastConfidence = 0.7;  // to act on hardware

// Of the effect `stiction`; nothing without s and j above 0, or where `alternatives`, which the
// record can't tell from it, have backlash or hysteresis.
std::optional<Stick> stick_of(const std::map<std::string, double>& parameters,
                              const std::map<std::string, std::array<double, 2>>& interval,
                              double confidence, const std::vector<std::string>& alternatives);

// Without a stick.
std::optional<control::PlannedMovesSettings> planned_moves_of(const plant::LoopModel& twin);
void set_stick(control::PlannedMovesSettings& settings, const Stick& stick) noexcept;
// What planned moves on hardware ask for: s within a factor of two, and that it is stiction.
bool known_well(const Stick& stick) noexcept;

}  // namespace loopwarden::twin
