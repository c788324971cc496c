// SPDX-License-Identifier: Apache-2.0
// The plant from CO to PV, as the controller sees it.
//
//   CO -> valve effects -> stem, flow -> process effects -> process -> disturbances
//      -> transmitter effects -> transmitter -> effects of its reading -> PV
//
// The step is fixed. PV at sample k+1 results from CO held since sample k. After the construction
// from a LoopModel it neither allocates nor throws. A copy continues exactly like the original.
#pragma once

#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/plant/loop_model.hpp"
#include "model/plant/process.hpp"
#include "model/plant/transmitter.hpp"

namespace loopwarden::plant {

class Plant {
 public:
  // Throws EffectError for a model that check_effect() rejects. Random numbers derive from `seed`.
  // The scheduled faults of the model are part of the plant.
  Plant(const LoopModel& model, std::uint64_t seed);

  // Sets the plant to rest at `co`, at time 0. An integrating process rests at the first set point
  // of the scenario, or in the middle of the transmitter's range.
  void reset(double co) noexcept;
  // Returns the CO at which the plant rests at `pv`, within the range of the output, as a start.
  // For an integrating process, which can rest at any CO, it is the middle of the range.
  double output_for(double pv) const;

  // Steps one period with `co` held. Returns PV at its end.
  double step(double co) noexcept;

  double process_variable() const noexcept { return pv_; }            // measured, PV units
  double true_process_variable() const noexcept { return true_pv_; }  // before the transmitter
  double stem() const noexcept { return stem_; }                      // stem travel, CO units
  double time_s() const noexcept { return static_cast<double>(samples_) * sample_time_s_; }
  // Returns the largest present severity of the scheduled faults.
  double fault_severity() const noexcept;

 private:
  double sample_time_s_;
  double output_low_;   // CO units
  double output_high_;  // CO units
  effects::EffectChain valve_;
  effects::EffectChain process_effects_;
  Process process_;
  bool integrating_;
  double level_;  // PV at CO 0, PV units; an integrating process starts at this PV for any CO
  effects::EffectChain disturbances_;
  effects::EffectChain transmitter_effects_;
  Transmitter transmitter_;
  effects::EffectChain reading_effects_;
  std::uint64_t samples_ = 0;
  double stem_ = 0.0;
  double true_pv_ = 0.0;
  double pv_ = 0.0;
};

}  // namespace loopwarden::plant
