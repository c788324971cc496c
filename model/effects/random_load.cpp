// SPDX-License-Identifier: Apache-2.0
#include "model/plant/random_load.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::random_load {

Descriptor describe() {
  return {
      .number = 17,
      .name = "random_load",
      .blocks = {Block::disturbance},
      .parameters = {at_least_zero("intensity", "PV units/sqrt(s)", "of the random walk"),
                     optional(above_zero("time_constant", "s", "with which it returns to zero"),
                              300.0)},
      .header = "random_load.hpp",
      .meaning = "an unmeasured load wanders",
      .remedy = "Nothing: it is what a plant does. Feedforward helps where its source is measured.",
      .make = [](const SpecReader& read, const EffectContext& context) -> plant::Effect {
        return plant::RandomLoad(read.value("intensity"), read.value("time_constant"),
                                 context.sample_time_s, context.seed);
      },
      .is_noise = true,
      .seen = "PV and CO wander without a pattern, over minutes.",
      .look_alikes =
          {{"drift", "goes one way at one rate."},
           {"output_bias", "constant."},
           {"every other effect",
            "a load that wanders hides what is smaller than itself, and with a constant set point "
            "it feeds back into CO: bias, gain and lags can't be named then."}},
      .examples = {{"random_load",
                    {"random_load", {{"intensity", 0.05}, {"time_constant", 300.0}}},
                    Block::disturbance}}};
}

}  // namespace loopwarden::effects::random_load
