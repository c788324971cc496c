// SPDX-License-Identifier: Apache-2.0
// The plant as the controller sees it: from CO to PV.
//
//   CO -> valve effects -> stem, flow -> process effects -> process -> disturbances
//      -> transmitter effects -> transmitter -> effects of its reading -> PV
//
// Fixed step. PV at sample k+1 follows from CO held since sample k. Made once from a LoopModel, it
// then neither allocates nor throws; a copy continues exactly like the original.
#pragma once

#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/plant/loop_model.hpp"
#include "model/plant/process.hpp"
#include "model/plant/transmitter.hpp"

namespace loopwarden::plant {

class Plant {
 public:
  // Throws EffectError for a model that check_effect() would refuse. Random numbers derive from
  // `seed`; the model's scheduled faults are part of the plant.
  Plant(const LoopModel& model, std::uint64_t seed);

  // Rest at `co`, at time 0. An integrating process rests where the scenario's set point begins, or in
  // the middle of the transmitter's range.
  void reset(double co) noexcept;
  // The CO at which the plant at rest gives `pv`, within the output's range: where to start from. The
  // middle of the range where the process integrates: there it rests at any.
  double output_for(double pv) const;

  // One period with `co` held. Returns PV at its end.
  double step(double co) noexcept;

  double process_variable() const noexcept { return pv_; }            // measured, PV units
  double true_process_variable() const noexcept { return true_pv_; }  // before the transmitter
  double stem() const noexcept { return stem_; }                      // stem travel, CO units
  double time_s() const noexcept { return static_cast<double>(samples_) * sample_time_s_; }
  // Largest severity of the scheduled faults now.
  double fault_severity() const noexcept;

 private:
  double sample_time_s_;
  double output_low_;   // CO units
  double output_high_;  // CO units
  effects::EffectChain valve_;
  effects::EffectChain process_effects_;
  Process process_;
  bool integrating_;
  double level_;  // PV units at CO 0; an integrating process starts there at any CO
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
