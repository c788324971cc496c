// SPDX-License-Identifier: Apache-2.0
// Loops that swing together: which ones, and where to look first.
//
// Sorted by period, two neighbours belong together where their periods differ by no more than 4 % (one cycle in
// twenty-five). In a group the likely source stands first: loops whose valve shows an effect by the probability of that, then
// those with the strongest nonlinearity (nonlinearity.hpp), the shorter name first where they are equal.
//
// Limits: it can't it is a list to look at, no finding. Loops that swing at one period by chance are in it; that a group
// lies in one part of the plant nobody told the survey.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::survey {

inline constexpr double kSamePeriod = 1.04;  // ratio

struct Swinging {
  std::size_t loop = 0;  // of the caller's list
  std::string tag;
  double period_s = 0.0;
  double valve_probability = 0.0;  // of a valve effect that is named; 0: none is
  double nonlinearity = 0.0;
};

struct Group {
  double period_s = 0.0;           // median
  std::vector<std::size_t> loops;  // the likely source first
};

// Of two loops at least, the largest first.
std::vector<Group> find_groups(std::span<const Swinging> loops);

}  // namespace loopwarden::survey
