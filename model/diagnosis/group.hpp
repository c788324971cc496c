// SPDX-License-Identifier: Apache-2.0
// Groups of loops that swing together, with the likely source of each group.
//
// Loops are sorted by period. Two neighbours belong together if their periods differ by at most 4 %
// (one cycle in twenty-five). In a group the likely source is first. Loops whose valve shows an
// effect are sorted by its probability. Then follow the others, by nonlinearity (nonlinearity.hpp).
// Of equals, the shorter name is first.
//
// Limits: a group is a list for inspection, not a finding. It includes loops that have the same
// period by chance. The survey doesn't know which loops share a part of the plant.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::diagnosis {

struct Swinging {
  std::size_t loop = 0;  // of the caller's list
  std::string tag;
  double period_s = 0.0;
  double valve_probability = 0.0;  // of a named valve effect; 0: no such effect
  double nonlinearity = 0.0;
};

struct Group {
  double period_s = 0.0;           // median
  std::vector<std::size_t> loops;  // the likely source first
};

// Returns groups of at least two loops, the largest first.
std::vector<Group> find_groups(std::span<const Swinging> loops);

}  // namespace loopwarden::diagnosis
