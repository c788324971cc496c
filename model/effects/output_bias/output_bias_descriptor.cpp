// SPDX-License-Identifier: Apache-2.0
#include "model/effects/output_bias/output_bias.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::output_bias {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back({.block = Block::transmitter,
                 .parameters = 1,
                 .solved = {"bias"},
                 .columns = 1,
                 .shifts_pv = true,
                 .is_level = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 13,
          .name = "output_bias",
          .blocks = {Block::transmitter},
          .parameters = {any_value("bias", "PV units", "added to PV")},
          .header = "output_bias/output_bias.hpp",
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return OutputBias(read.value("bias"));
          },
          .candidates = candidates,
          .examples = {{"output_bias", {"output_bias", {{"bias", 0.4}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::output_bias
