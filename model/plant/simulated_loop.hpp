// SPDX-License-Identifier: Apache-2.0
// The closed loop: the controller of model/control on the plant of plant.hpp.
//
// Each sample takes SP from the profile, PV from the plant and CO from the controller. CO is then
// held for one period. `u_valve` of the jacket is the stem of the plant.
#pragma once

#include <cstddef>

#include "model/control/simulated_controller.hpp"
#include "model/plant/loop_model.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::plant {

struct LoopSample {
  double time_s = 0.0;
  double sp = 0.0;                  // PV units
  double pv = 0.0;                  // PV units, measured
  double co = 0.0;                  // CO units, sent to the valve
  double stem = 0.0;                // CO units
  double true_pv = 0.0;             // PV units
  double jacket_rate = 0.0;         // CO units/s, acting
  double jacket_shadow_rate = 0.0;  // CO units/s, requested
  double correction = 0.0;          // CO units, added by the compensator
  double severity = 0.0;            // of the scheduled faults, 0 to 1
};

class SimulatedLoop {
 public:
  // Starts at rest at the first set point of the scenario, in automatic. CO is rounded to
  // `output_resolution` (CO units; 0: no rounding) as by a converter.
  explicit SimulatedLoop(const LoopModel& model, double output_resolution = 0.0);

  // Returns the next sample. The loop never ends; the last set point stays in force.
  LoopSample step() noexcept;

  control::SimulatedController& controller() noexcept { return controller_; }
  const Plant& plant() const noexcept { return plant_; }

 private:
  std::vector<std::pair<double, double>> set_point_;  // (s, PV units)
  std::size_t next_set_point_ = 0;
  double output_low_;         // CO units
  double output_resolution_;  // CO units
  Plant plant_;
  control::SimulatedController controller_;
};

}  // namespace loopwarden::plant
