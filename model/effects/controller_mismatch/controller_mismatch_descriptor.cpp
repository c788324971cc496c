// SPDX-License-Identifier: Apache-2.0
// Not an effect of the plant: `gap` finds it by replaying the controller
// (model/gap/controller.hpp).
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::controller_mismatch {

Descriptor describe() {
  return {
      .number = 18,
      .name = "controller_mismatch",
      .blocks = {Block::controller},
      .parameters = {any_value("kp", "CO units/PV unit", "proportional gain found in the record"),
                     any_value("ki", "CO units/(PV unit s)", "integral gain found in the record"),
                     optional(above_zero("filter", "s", "time constant of a filter on PV"), 0.0),
                     optional(above_zero("dead_band", "PV units", "smaller errors count as 0"),
                              0.0)},
      .examples = {{"controller_mismatch",
                    {"controller_mismatch", {{"kp", 0.2}, {"ki", 0.07}}},
                    Block::controller}}};
}

}  // namespace loopwarden::effects::controller_mismatch
