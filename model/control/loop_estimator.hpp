// SPDX-License-Identifier: Apache-2.0
// Estimates what planned moves must know of a loop: friction, stem and disturbance.
//
// In shadow a model of valve and process is stepped in addition, with the real disturbance and the
// same output limits. No call allocates or throws.
#pragma once

#include "model/control/disturbance_estimator.hpp"
#include "model/control/held_output.hpp"
#include "model/control/stem_estimator.hpp"
#include "model/control/valve_friction.hpp"

namespace loopwarden::control {

// Valve and process under planned moves in shadow.
struct ShadowLoop {
  StictionStem stem;
  NominalProcess process;
  double output = 0.0;  // CO units
};

class LoopEstimator {
 public:
  LoopEstimator(const PlannedMovesSettings& settings, bool shadow, double period_s) noexcept;

  // One period. `active`: planned moves hold CO at `held`, in shadow that of the shadow loop.
  // `learns`: slips that are read back improve the friction.
  void observe(const CompensatorInputs& in, bool active, bool learns, double held) noexcept;
  // Planned moves take over with CO at `output`: the shadow loop begins where the real one is.
  void take_over(double output) noexcept;
  // The real loop counts from now on.
  void begin_acting() noexcept { shadow_ = false; }

  bool shadow() const noexcept { return shadow_; }
  bool seen() const noexcept { return read_back_ && !shadow_; }
  bool lost() const noexcept { return real_stem_.lost_samples() > 0; }
  double gain() const noexcept { return gain_; }    // PV units/CO unit
  double error() const noexcept { return error_; }  // SP - PV, of the shadow loop in shadow
  double set_point() const noexcept { return set_point_; }
  const OutputLimits& limits() const noexcept { return limits_; }
  const StemEstimator& read_back() const noexcept { return real_stem_; }
  const DisturbanceEstimator& disturbance() const noexcept { return disturbance_; }
  DisturbanceEstimator& disturbance() noexcept { return disturbance_; }
  const ValveFriction& friction() const noexcept { return friction_; }
  ValveFriction& friction() noexcept { return friction_; }
  double shadow_output() const noexcept { return shadow_loop_.output; }  // CO units

  // The stem that counts: the shadow loop's in shadow while `active`.
  const Stem& stem(bool active) const noexcept {
    return shadow_ && active ? shadow_loop_.stem.stem() : real_stem_.stem();
  }
  void reset_travel() noexcept;
  // SP minus the PV that the stem leads to if it stays, PV units.
  double expected_offset(const Stem& stem) const noexcept {
    return set_point_ - gain_ * stem.position - disturbance_.disturbance();
  }
  // SP - PV within it is noise, and no slip. PV units.
  double margin(double given_j) const noexcept;
  // Time of a ramp by `distance`, CO units, at the output's rate limit.
  double ramp_s(double distance) const noexcept { return distance / limits_.rate_per_s; }

 private:
  bool read_back_;
  bool shadow_;
  double period_s_;
  double gain_;
  ValveFriction friction_;
  StemEstimator real_stem_;
  DisturbanceEstimator disturbance_;
  ShadowLoop shadow_loop_;
  OutputLimits limits_{.low = 0.0, .high = 0.0};
  double set_point_ = 0.0;
  double error_ = 0.0;  // PV units
};

}  // namespace loopwarden::control
