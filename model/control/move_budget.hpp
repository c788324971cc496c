// SPDX-License-Identifier: Apache-2.0
// Limits how many moves planned moves may make, and how far the stem may travel.
//
// Three limits: a token bucket, the moves of the last hour, and stem travel at 95 % of the loop
// without planned moves. A detour is two moves. The stem's moves of the last hour count over a
// change of the settings and over a time in shadow. No call allocates or throws.
#pragma once

#include <array>
#include <cstddef>

#include "model/control/cycle_statistics.hpp"

namespace loopwarden::control {

// Moves of the last hour, counted per minute. With less than one move per hour: of the last
// 1/max_per_hour hours.
class LastHour {
 public:
  explicit LastHour(double max_per_hour) noexcept;
  void pass(double period_s) noexcept;
  bool has_room(double moves) const noexcept { return made_ + moves <= most_; }
  void add() noexcept;
  // Takes the moves of `other` over, under the limit of this one.
  void take_over(const LastHour& other) noexcept;

 private:
  double part_s_;
  double most_;
  double made_ = 0.0;
  double since_s_ = 0.0;  // age of the newest part
  std::size_t newest_ = 0;
  std::array<float, 61> parts_{};
};

class MoveBudget {
 public:
  MoveBudget(double max_moves_per_hour, double period_s) noexcept;

  // Before the first step: continues the hour of `before`. `shadow`: only the stem's moves do.
  void continue_hour(const MoveBudget& before, bool shadow) noexcept;
  // A shadow begins to act: only the stem's moves count.
  void begin_acting() noexcept { hour_ = acted_; }
  // Planned moves engage; `j`: CO units.
  void restart(double j) noexcept;
  void pass() noexcept;

  bool allows(double moves) const noexcept { return tokens_ >= moves && hour_.has_room(moves); }
  void plan(double moves) noexcept { tokens_ -= moves; }
  // The stem begins to move, in shadow in the model only.
  void count(bool shadow) noexcept;

  // CO units of travel that are left; below 0: overdrawn.
  double travel() const noexcept { return travel_; }
  void earn_travel(const LoopBaseline& baseline, double j) noexcept;
  void spend_travel(double travel, double j) noexcept;

 private:
  double max_moves_per_hour_;
  double period_s_;
  double tokens_ = 0.0;  // moves
  LastHour hour_;        // moves that are made, in shadow those that would be
  LastHour acted_;       // moves of the stem
  double travel_ = 0.0;
};

}  // namespace loopwarden::control
