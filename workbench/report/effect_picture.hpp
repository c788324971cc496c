// SPDX-License-Identifier: Apache-2.0
// Draws the signature of an effect: the same loop with and without it, simulated.
#pragma once

#include <string>
#include <vector>

#include "model/effects/descriptor.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::workbench {

// Returns one example of every effect in the vocabulary.
std::vector<effects::Example> effect_examples();

// Returns flow plant 1 of the thesis, without noise, with steps through three set points.
plant::LoopModel effect_example_model();

// Returns a text such as "stiction, s 1, j 0.4".
std::string example_text(const effects::Example& example);

// Draws PV, CO and the residual over time. For an effect of the valve it also draws the flow over
// CO, for other effects PV over CO. The residual is PV minus the PV of a model without the effect,
// driven by the same CO. For the controller it is CO minus the CO of the model's controller with
// the same SP and PV.
std::string effect_picture_svg(const effects::Example& example);

}  // namespace loopwarden::workbench
