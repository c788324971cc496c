// SPDX-License-Identifier: Apache-2.0
#include "model/plant/held_measurement.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::held_measurement {

Descriptor describe() {
  return {
      .number = 21,
      .name = "held_measurement",
      .blocks = {Block::transmitter},
      .parameters = {above_zero("interval", "s", "in which the value is renewed once"),
                     optional(at_least_zero("first", "s", "time of the first renewal"), 0.0)},
      .header = "held_measurement.hpp",
      .meaning = "the measurement is renewed only now and then",
      .remedy =
          "Tune for the interval as additional dead time, or ask for a faster update of the "
          "analyser or the bus.",
      .make = [](const SpecReader& read, const EffectContext&) -> plant::Effect {
        return plant::HeldMeasurement(read.value("interval"), read.value("first"));
      },
      .linear =
          [](const SpecReader& read) {
            return LinearPart{.dead_time_s = read.value("interval") / 2.0};
          },
      .seen =
          "PV is a staircase with treads of equal length, exactly flat, and CO jumps with each: "
          "analysers, wireless and multiplexed transmitters. The loop is slower by half a tread; "
          "tune for that, or run the controller once for each new value.",
      .look_alikes = {{"resolution",
                       "treads of equal height instead, as long as PV takes from one to the next."},
                      {"extra_dead_time", "PV keeps its shape; a held one is flat in between."},
                      {"compression by the historian",
                       "only the record is flat: look at PV in the control system itself."}},
      .examples = {{"held_measurement",
                    {"held_measurement", {{"interval", 6.0}}},
                    Block::transmitter}}};
}

}  // namespace loopwarden::effects::held_measurement
