// SPDX-License-Identifier: Apache-2.0
// Simulates the loops of a plant with their faults. The same seed gives the same plant.
//
// Loops that follow a sticky loop oscillate with its period, measured on its PV: a sine is added to
// their load.
// Limits: no loops that disturb each other both ways, no plants that start up and shut down.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace loopwarden::lab {

struct SimulatedTag {
  std::string tag;
  std::string truth;           // healthy, stiction, backlash, tuning, follower
  double size = 0.0;           // CO units: s or deadband
  std::vector<double> pv, co;  // one sample per period
  std::vector<double> sp;
};

struct PlantSettings {
  std::size_t loops = 200;
  std::size_t days = 1;
  double period_s = 10.0;
  std::size_t loops_a_unit = 10;
  std::uint64_t seed = 1;
};

// Returns unit `unit`, from 0: its loops over all days.
std::vector<SimulatedTag> simulate_unit(const PlantSettings& settings, std::size_t unit);

}  // namespace loopwarden::lab
