// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "model/plant/loop_model.hpp"

namespace loopwarden::bench {

// The thesis's plant 1 with its tuned PI controller and a noisy 12-bit transmitter.
inline plant::LoopModel plant1() {
  plant::LoopModel model;
  model.sample_time_s = 0.1;
  model.controller.pid.gains = {.kp = 0.61145 / 1.75, .ki = 0.070013 / 1.75};
  model.controller.pid.output_high = 10.0;
  model.controller.output.high = 10.0;
  model.controller.set_point.high = 10.0;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 10.0 / 4096.0, .noise = 0.01};
  model.scenario.set_point = {{0.0, 5.0}};
  return model;
}

inline plant::LoopModel sticking_plant1() {
  plant::LoopModel model = plant1();
  effects::EffectSpec stiction;
  stiction.name = "stiction";
  stiction.parameters = {{"s", 0.6}, {"j", 0.2}};
  model.valve_effects.push_back(stiction);
  model.controller.jacket.form = control::JacketForm::bounded;
  return model;
}

// Returns the same valve with planned_moves.
inline plant::LoopModel calmed_plant1() {
  plant::LoopModel model = sticking_plant1();
  model.controller.jacket = {};
  model.controller.compensator = {.kind = control::CompensatorKind::planned_moves,
                                  .planned = {.gain = 1.2264,
                                              .time_constant_s = 1.69376,
                                              .dead_time_s = 2.6256,
                                              .load = 0.002,
                                              .s = 0.6,
                                              .j = 0.2}};
  return model;
}

}  // namespace loopwarden::bench
