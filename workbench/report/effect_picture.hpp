// SPDX-License-Identifier: Apache-2.0
// The signature of an effect: the same loop with and without it, simulated and drawn.
#pragma once

#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::workbench {

struct EffectExample {
  std::string file;  // of the picture, without its ending
  plant::EffectSpec spec;
  plant::Block block;
};

// At least one for each effect of the catalogue, and controller_mismatch.
std::vector<EffectExample> effect_examples();

// Flow plant 1 of the thesis, without noise, stepping through three set points.
plant::LoopModel effect_example_model();

// As text: "stiction, s 1, j 0.4".
std::string example_text(const EffectExample& example);

// PV, CO and the residual over time, and for an effect of the valve the flow over CO, for others PV
// over CO. The residual is PV less that of a model without the effect driven by the same CO; for
// the controller it is CO less that of the model's controller given the same SP and PV.
std::string effect_picture_svg(const EffectExample& example);

}  // namespace loopwarden::workbench
