// SPDX-License-Identifier: Apache-2.0
#include "model/plant/positioner.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::positioner {
namespace {

plant::Effect make(const SpecReader& read, const EffectContext& context) {
  return plant::Positioner({.dead_band = read.value("dead_band"),
                            .gain_per_s = read.value("gain"),
                            .lag_s = read.value("lag"),
                            .breakaway = read.value("breakaway")},
                           context.output_low, context.output_high, context.sample_time_s);
}

}  // namespace

Descriptor describe() {
  return {
      .number = 7,
      .name = "positioner",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("dead_band", "CO units", "what CO loses on a reversal"),
                     above_zero("gain", "1/s", "of the relay"),
                     above_zero("lag", "s", "of the actuator's volume"),
                     optional(at_least_zero("breakaway", "CO units", "what opens a shut valve"),
                              0.0)},
      .header = "positioner.hpp",
      .meaning = "the positioner has a dead band, overshoots large steps, and sticks when shut",
      .remedy = "Check the positioner's dead band and its tight-shut setting.",
      .make = make,
      .alarms = {"unknown"},
      .seen =
          "Small moves of CO are ignored, large ones overshoot, and the stem rests anywhere "
          "within the dead band. With `breakaway` a shut valve opens late.",
      .look_alikes =
          {{"backlash",
            "loses the same on a reversal but never overshoots; here a large step overshoots and "
            "comes to rest within the dead band."},
           {"positioner_overshoot",
            "rings after small moves as after large ones and leaves nothing behind."},
           {"stiction", "jumps after the rest, at any opening; a positioner creeps on."}},
      .examples = {{"positioner",
                    {"positioner", {{"dead_band", 0.3}, {"gain", 0.8}, {"lag", 1.2}}},
                    Block::valve}}};
}

}  // namespace loopwarden::effects::positioner
