// SPDX-License-Identifier: Apache-2.0
// PV of a self-regulating process with one lag and dead time, without disturbance.
//
//   y' = (K x(t - L) - y) / T       x  stem, CO units      y  PV units
//
// The dead time is kept in slots of at most L/250 s. No call allocates or throws.
#pragma once

#include <array>
#include <cstddef>

#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

class NominalProcess {
 public:
  NominalProcess(const PlannedMovesSettings& settings, double period_s) noexcept;

  // Sets PV to the steady state of `stem`.
  void reset(double stem) noexcept;
  // Steps one period with the stem at `stem`.
  void step(double stem) noexcept;
  double value() const noexcept { return value_; }

 private:
  static constexpr std::size_t kSlots = 256;
  double gain_;
  double approach_;     // share of the way to the steady state per period
  std::size_t stride_;  // periods per slot
  std::size_t delay_;   // slots
  std::size_t phase_ = 0;
  std::size_t newest_ = 0;
  double value_ = 0.0;
  std::array<float, kSlots> stems_{};
};

}  // namespace loopwarden::control
