// SPDX-License-Identifier: Apache-2.0
// Settings of planned moves (model/control/planned_moves.hpp) from what is known of a loop that sticks: process and load
// from its twin, s and j from what explains its alarm.
//
// A second lag T2 counts half as lag and half as dead time.
//
// Errors: none; where the process integrates there are no settings.
// What it can't do: a gain that changes with the opening is that of the twin's process.
//
// Source of the half rule: Skogestad, J. Process Control 13 (2003) 291-309.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "model/control/planned_moves.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::commission {

// Of a valve, CO units; an interval that is not known is {0, 0}.
struct Stick {
  double s = 0.0;
  double j = 0.0;
  std::array<double, 2> s_interval{};
  std::array<double, 2> j_interval{};
};

// Of the effect `stiction`; nothing without s and j above 0.
std::optional<Stick> stick_of(const std::map<std::string, double>& parameters,
                              const std::map<std::string, std::array<double, 2>>& interval);

// Without a stick.
std::optional<control::PlannedMovesSettings> planned_moves_of(const plant::LoopModel& twin);
void set_stick(control::PlannedMovesSettings& settings, const Stick& stick) noexcept;
// s is within a factor of two: what planned moves on hardware ask for.
bool known_well(const Stick& stick) noexcept;

}  // namespace loopwarden::commission
