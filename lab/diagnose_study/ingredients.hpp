// SPDX-License-Identifier: Apache-2.0
// Properties of plants that textbook loops lack. Each can be switched separately, so that its
// effect on the simulated loops can be measured (README.md has the figures). Ranges are from the
// stated source or from physics.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace loopwarden::lab {

enum class Ingredient : std::uint8_t {
  // Process times in seconds, by kind, logged every 1 to 60 s: flow loops are faster than their
  // log. F. G. Shinskey, Process Control Systems (1996), properties of common loops.
  seconds,
  // Flow and pressure controllers with rule-of-thumb tuning, far slower than the process: gain
  // times process gain 0.1 to 1.5, closed loop 5 to 300 s. W. L. Bialkowski, Pulp & Paper Canada 94
  // (1993); M. L. and W. L. Luyben, Essentials of Process Control (1997).
  sluggish,
  // Controllers with dominant gain: integral time 3 to 30 times the usual one.
  proportional,
  // Levels under averaging control: gain 0.5 to 3, integral time of the overdamped loop, or up to
  // ten times as long. T. F. Cheung and W. L. Luyben, Ind. Eng. Chem. Fundam. 18 (1979).
  averaging,
  // Slave loops: SP is a controller output and moves at each scan of its master, with the noise of
  // the master's PV. It moves the slave more than the slave's own loads do.
  master,
  // The controller runs every 0.1 to 5 s (scan classes of control systems) and holds its output in
  // between.
  scan,
  // Damping of the transmitter, 0.4 to 16 s (ranges of data sheets), and a filter in the
  // controller. The noise is filtered by both.
  filter,
  // Another flow on the same header, with a sticking valve: the header's pressure falls with the
  // sum of the flows.
  neighbour,
  // Regular disturbances at least ten times slower than the loop: sine, triangle, saw.
  regular,
  // Unstable loops that only the range of CO limits.
  limits,
  // A valve that reaches its limit before CO does (travel stop, limit in the positioner), so that
  // the integral winds up.
  windup,
  // PV and CO logged in steps of 0.024 to 1 % of span: converters of 8 and 12 bits, one decimal,
  // whole numbers.
  steps,
  // Stretches in which the log repeats the last value of each signal (OPC UA, part 8: last usable
  // value).
  stale,
  // Labels as given by observers. A valve is called sticking if its stem moves PV more than loads,
  // SP and noise do. This must occur at least four times, three samples apart or more.
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

}  // namespace loopwarden::lab
