// SPDX-License-Identifier: Apache-2.0
// Checks whether PV answers a move of the stem as the model predicts.
//
// A PV that does not move looks like a disturbance that takes back the whole move. Moves too small
// for the uncertainty of the disturbance are not judged. No call allocates or throws.
#pragma once

#include <cstdint>

#include "model/control/disturbance_estimator.hpp"
#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

enum class Response : std::uint8_t { answered, too_small, missing, contradicts };

class ResponseCheck {
 public:
  explicit ResponseCheck(const PlannedMovesSettings& settings) noexcept;

  void take_over() noexcept { due_ = slipped_ = false; }
  void restart() noexcept { unanswered_ = 0; }

  // The stem leaves `position`, CO units, with the disturbance as it is.
  void begin(double position, const DisturbanceEstimator& now) noexcept;
  // A probe is pushed: changes of the disturbance count from here.
  void begin_probe(const DisturbanceEstimator& now) noexcept;
  double disturbance_before() const noexcept { return disturbance_before_; }           // PV units
  double moved(double position) const noexcept { return gain_ * (position - from_); }  // PV units

  // The move has ended; with `due` PV is judged after the time `wait_s()`.
  void await(bool due) noexcept { due_ = due; }
  // The stem moved without a move being planned.
  void slipped() noexcept { slipped_ = due_ = true; }
  void forget_slip() noexcept { slipped_ = false; }
  bool due() const noexcept { return due_; }
  bool has_slipped() const noexcept { return slipped_; }
  double wait_s() const noexcept { return wait_s_; }

  // Judges PV `rested_s` after the move, with the stem at `position`.
  Response judge(double position, const DisturbanceEstimator& now, double rested_s) noexcept;

 private:
  double gain_;
  double intensity_;  // PV units / sqrt(s)
  double wait_s_;     // L + 3 T
  bool read_back_;
  double from_ = 0.0;                // CO units, stem before the move
  double disturbance_before_ = 0.0;  // PV units
  double variance_before_ = 0.0;     // PV units^2
  bool due_ = false;
  bool slipped_ = false;
  std::uint32_t unanswered_ = 0;
};

}  // namespace loopwarden::control
