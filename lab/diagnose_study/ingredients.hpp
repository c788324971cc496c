// SPDX-License-Identifier: Apache-2.0
// What plants have and textbook loops lack, one by one, so that what each brings to the simulated loops can be measured
// (README.md has the figures). Ranges come from the source named, or from physics.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::studies {

enum class Ingredient : std::uint8_t {
  // Process times in seconds, by kind, logged each 1 to 60 s: flow loops are faster than their log. F. G. Shinskey, Process
  // Control Systems (1996), properties of common loops.
  seconds,
  // Flow and pressure controllers set by rule of thumb, far slower than the process: gain times process gain 0.1 to 1.5, closed
  // loop 5 to 300 s. W. L. Bialkowski, Pulp & Paper Canada 94 (1993); M. L. and W. L. Luyben, Essentials of Process Control (1997).
  sluggish,
  // Controllers that lean on their gain: integral time 3 to 30 times the usual one.
  proportional,
  // Levels under averaging control: gain 0.5 to 3, integral time of the overdamped loop or up to ten times that. T. F. Cheung and
  // W. L. Luyben, Ind. Eng. Chem. Fundam. 18 (1979).
  averaging,
  // Slave loops: SP is a controller output and moves at each scan of its master, with the noise of the master's PV; it
  // moves the slave more than the slave's own loads do.
  master,
  // The controller works each 0.1 to 5 s (scan classes of control systems) and holds its output between.
  scan,
  // Damping of the transmitter, 0.4 to 16 s (ranges of data sheets), and a filter in the controller. Noise passes both.
  filter,
  // Another flow on the same header, whose valve sticks: the header's pressure falls with the sum of the flows.
  neighbour,
  // Disturbances that are regular and ten times slower than the loop or more: sine, triangle, saw.
  regular,
  // Loops beyond the edge of stability, which only the range of CO bounds.
  limits,
  // A valve that ends before CO does (travel stop, limit in the positioner): nothing stops the integral there.
  windup,
  // PV and CO logged in steps of 0.024 to 1 % of span: converters of 8 and 12 bits, one decimal, whole numbers.
  steps,
  // Stretches in which the log repeats the last value of every signal (OPC UA, part 8: last usable value).
  stale,
  // Labels are given by people who see it: a valve is called sticking where its stem moves PV more than loads, SP and noise
  // do, at least four times, and three samples apart or more.
  noticed
};

inline constexpr std::array kIngredientNames{
    "seconds",   "sluggish", "proportional", "averaging", "master", "scan",  "filter",
    "neighbour", "regular",  "limits",       "windup",    "steps",  "stale", "noticed"};

using Ingredients = std::bitset<kIngredientNames.size()>;
inline Ingredients all_ingredients() { return Ingredients{}.set(); }

inline std::optional<Ingredient> ingredient(std::string_view name) {
  for (std::size_t i = 0; i < kIngredientNames.size(); ++i) {
    if (name == kIngredientNames[i]) return static_cast<Ingredient>(i);
  }
  return std::nullopt;
}

}  // namespace loopwarden::studies
