// SPDX-License-Identifier: Apache-2.0
// Estimates the friction of a valve in each direction: breakaway and kinetic offset.
//
//   breakaway       CO minus stem, CO units, at which the stem breaks loose in this direction
//   kinetic offset  CO minus stem, CO units, after the stem has moved in this direction
//   s, j            sum and difference of one direction's breakaway and the other's kinetic offset
//
// Directions are +1 (up) and -1 (down). s and j stay within 0.6 to 1.6 times their given intervals.
// No call allocates or throws.
#pragma once

#include <array>

#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

class ValveFriction {
 public:
  explicit ValveFriction(const PlannedMovesSettings& settings) noexcept;

  double s() const noexcept;
  double j() const noexcept;
  double breakaway(double direction) const noexcept { return of(direction).breakaway; }
  double kinetic_offset(double direction) const noexcept { return of(direction).kinetic_offset; }
  // CO minus stem halfway between the kinetic offsets of both directions.
  double centre() const noexcept {
    return 0.5 * (directions_[0].kinetic_offset + directions_[1].kinetic_offset);
  }

  // A jump that no slip exceeds, CO units. `seen`: the stem is read back. Without a read-back a
  // stem that did not move is not noticed, so the upper bounds of s and j count.
  double largest_jump(bool seen) const noexcept;
  // CO units from the centre that break the stem loose for certain.
  double sure_breakaway(double direction, bool seen) const noexcept;

  // A slip was read back: CO minus stem before and after it.
  void learn_slip(double direction, double breakaway, double kinetic_offset) noexcept;
  // A move ended with CO minus stem at `kinetic_offset`.
  void learn_landing(double direction, double kinetic_offset) noexcept;
  // Without a read-back: PV did not answer a move.
  void raise_force() noexcept;

 private:
  struct Direction {
    double breakaway = 0.0;
    double kinetic_offset = 0.0;
    double weight = 1.0;  // of the next slip
  };
  const Direction& of(double direction) const noexcept {
    return directions_[direction > 0.0 ? 1 : 0];
  }
  Direction& of(double direction) noexcept { return directions_[direction > 0.0 ? 1 : 0]; }

  double s_;
  double s_low_;
  double s_high_;
  double j_;
  double j_low_;
  double j_high_;
  std::array<Direction, 2> directions_{};  // down, up
  double force_ = 1.0;  // factor on the force that breaks the stem loose, without a read-back
};

}  // namespace loopwarden::control
