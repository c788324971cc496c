// SPDX-License-Identifier: Apache-2.0
#include "model/effects/held_measurement/held_measurement.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::held_measurement {

Descriptor describe() {
  return {.number = 21,
          .name = "held_measurement",
          .blocks = {Block::transmitter},
          .parameters = {above_zero("interval", "s", "in which the value is renewed once"),
                         optional(at_least_zero("first", "s", "time of the first renewal"), 0.0)},
          .header = "held_measurement/held_measurement.hpp",
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return HeldMeasurement(read.value("interval"), read.value("first"));
          },
          .linear =
              [](const SpecReader& read) {
                return LinearPart{.dead_time_s = read.value("interval") / 2.0};
              },
          .examples = {{"held_measurement",
                        {"held_measurement", {{"interval", 6.0}}},
                        Block::transmitter}}};
}

}  // namespace loopwarden::effects::held_measurement
