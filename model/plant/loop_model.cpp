// SPDX-License-Identifier: Apache-2.0
#include "model/plant/loop_model.hpp"

#include <cmath>

#include "model/effects/catalogue.hpp"

namespace loopwarden::plant {

double answer_s(const LoopModel& model) noexcept {
  const ProcessParameters& p = model.process;
  const double kp = model.controller.pid.gains.kp;
  const bool led = p.integrating() && kp > 0.0;
  return p.lags_and_dead_time_s() + (led ? 1.0 / (std::abs(p.gain) * kp) : 0.0);
}

LoopModel without_noise(LoopModel model) {
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  const auto is_noise = [](const effects::EffectSpec& spec) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    return info != nullptr && info->is_noise;
  };
  std::erase_if(model.disturbances, is_noise);
  std::erase_if(model.transmitter_effects, is_noise);
  return model;
}

}  // namespace loopwarden::plant
