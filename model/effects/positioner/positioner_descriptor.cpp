// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner/positioner.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::positioner {
namespace {

Effect make(const SpecReader& read, const EffectContext& context) {
  return Positioner({.dead_band = read.value("dead_band"),
                     .gain_per_s = read.value("gain"),
                     .lag_s = read.value("lag"),
                     .breakaway = read.value("breakaway")},
                    context.output_low, context.output_high, context.sample_time_s);
}

}  // namespace

Descriptor describe() {
  return {.number = 7,
          .name = "positioner",
          .blocks = {Block::valve},
          .parameters = {at_least_zero("dead_band", "CO units", "what CO loses on a reversal"),
                         above_zero("gain", "1/s", "of the relay"),
                         above_zero("lag", "s", "of the actuator's volume"),
                         optional(at_least_zero("breakaway", "CO units", "what opens a shut valve"),
                                  0.0)},
          .header = "positioner/positioner.hpp",
          .make = make,
          .alarms = {"unknown"},
          .examples = {{"positioner",
                        {"positioner", {{"dead_band", 0.3}, {"gain", 0.8}, {"lag", 1.2}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::positioner
