// SPDX-License-Identifier: Apache-2.0
// No effect of the plant: `gap` finds it by replaying the controller (gap/controller_block.hpp).
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::controller_mismatch {

Descriptor describe() {
  return {
      .number = 18,
      .name = "controller_mismatch",
      .blocks = {Block::controller},
      .parameters = {any_value("kp", "CO units/PV unit", "proportional gain found in the record"),
                     any_value("ki", "CO units/(PV unit s)", "integral gain found in the record")},
      .meaning = "the controller's settings are others than believed",
      .remedy =
          "Compare the settings in the controller with those that were handed over; keep the "
          "better ones in both places.",
      .seen =
          "The model's controller, given the measured SP and PV, gives another CO; from CO to "
          "PV there is no gap.",
      .look_alikes =
          {{"every effect of valve and process",
            "changes PV for the same CO; another tuning changes CO for the same SP and PV."},
           {"another anti-windup",
            "CO differs only at and after its limits: that is no mismatch of the tuning."}},
      .examples = {{"controller_mismatch",
                    {"controller_mismatch", {{"kp", 0.2}, {"ki", 0.07}}},
                    Block::controller}}};
}

}  // namespace loopwarden::effects::controller_mismatch
