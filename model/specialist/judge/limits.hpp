// SPDX-License-Identifier: Apache-2.0
// Constants that decide the verdict of the team of specialists on a window.
// Source: chosen by hand on simulated windows. `loopwarden-study specialist` measures their effect.
#pragma once

namespace loopwarden::specialist {

struct JudgeLimits {
  static constexpr double kFault = 0.95;            // p of all faults together
  static constexpr double kNamed = 0.75;            // p of the best fault
  static constexpr double kNoFault = 0.8;           // p
  static constexpr double kUnknown = 0.8;           // p of `other`
  static constexpr double kMisfitQuantile = 0.995;  // of the training windows
  static constexpr double kMostShut = 0.3;          // of a window with CO at an end of its range
  static constexpr double kLeastMovement = 6.0;  // standard deviations of the noise, blocks of CO
};

}  // namespace loopwarden::specialist
