// SPDX-License-Identifier: Apache-2.0
// Estimates the disturbance d = PV - y of a loop, with y of NominalProcess, and its variance P.
//
// A Kalman filter for a random walk. It weighs PV less while the process has to go more of a move
// than the model is right for. P rises while PV - y - d stays on one side.
// docs/math/planned-moves.md has the equations. No call allocates or throws.
#pragma once

#include "model/control/nominal_process.hpp"
#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

class DisturbanceEstimator {
 public:
  DisturbanceEstimator(const PlannedMovesSettings& settings, double period_s) noexcept;

  // One period with the stem at `stem`, CO units. The first one assumes a steady state.
  void step(double process_variable, double stem) noexcept;

  double disturbance() const noexcept { return disturbance_; }        // PV units
  double variance() const noexcept { return variance_; }              // of it, PV units^2
  double noise_variance() const noexcept { return noise_variance_; }  // of PV, PV units^2
  const NominalProcess& process() const noexcept { return process_; }

  void set_variance(double variance) noexcept { variance_ = variance; }
  // A move by `moved` PV units has ended: the model's gain may be wrong by a share of it.
  void add_gain_error(double moved) noexcept;

 private:
  double gain_;
  double s_;  // CO units
  double period_s_;
  double response_s_;  // L + T
  double intensity_;   // PV units / sqrt(s)
  NominalProcess process_;
  bool started_ = false;
  double last_process_variable_ = 0.0;
  double noise_variance_ = 0.0;
  double disturbance_ = 0.0;
  double variance_;
  double one_sided_ = 0.0;  // mean of PV - y - d, PV units
};

}  // namespace loopwarden::control
