// SPDX-License-Identifier: Apache-2.0
// The signature of an effect: the same loop with and without it, simulated and drawn.
#pragma once

#include <string>
#include <vector>

#include "model/effects/descriptor.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::workbench {

// Of every effect in the vocabulary.
std::vector<effects::Example> effect_examples();

// Flow plant 1 of the thesis, without noise, stepping through three set points.
plant::LoopModel effect_example_model();

// As text: "stiction, s 1, j 0.4".
std::string example_text(const effects::Example& example);

// PV, CO and the residual over time, and for an effect of the valve the flow over CO, for others PV
// over CO. The residual is PV less that of a model without the effect driven by the same CO; for
// the controller it is CO less that of the model's controller given the same SP and PV.
std::string effect_picture_svg(const effects::Example& example);

}  // namespace loopwarden::workbench
