// SPDX-License-Identifier: Apache-2.0
#include "model/effects/random_load/random_load.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::random_load {

Descriptor describe() {
  return {.number = 17,
          .name = "random_load",
          .blocks = {Block::disturbance},
          .parameters = {at_least_zero("intensity", "PV units/sqrt(s)", "of the random walk"),
                         optional(above_zero("time_constant", "s", "with which it returns to zero"),
                                  300.0)},
          .header = "random_load/random_load.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return RandomLoad(read.value("intensity"), read.value("time_constant"),
                              context.sample_time_s, context.seed);
          },
          .is_noise = true,
          .examples = {{"random_load",
                        {"random_load", {{"intensity", 0.05}, {"time_constant", 300.0}}},
                        Block::disturbance}}};
}

}  // namespace loopwarden::effects::random_load
