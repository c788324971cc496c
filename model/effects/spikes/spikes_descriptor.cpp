// SPDX-License-Identifier: Apache-2.0
#include "model/effects/spikes/spikes.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::spikes {

Descriptor describe() {
  return {
      .number = 34,
      .name = "spikes",
      .blocks = {Block::transmitter},
      .parameters = {{"share", "-", 0.0, false, 1.0, false, true, 0.0, "of the samples"},
                     at_least_zero("size", "PV units", "of each")},
      .header = "spikes/spikes.hpp",
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return Spikes(read.value("share"), read.value("size"), context.seed);
      },
      .is_noise = true,
      .examples = {{"spikes", {"spikes", {{"share", 0.02}, {"size", 1.0}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::spikes
