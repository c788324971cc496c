// SPDX-License-Identifier: Apache-2.0
#include "model/effects/plugging/plugging.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::plugging {
namespace {

// The search covers lags up to three times that of the process at the end of the record.
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.block = Block::transmitter,
                 .parameters = 1,
                 .search = {between("rate", 0.2 * c.period_s / c.duration_s,
                                    3.0 * c.slow_s() / c.duration_s, true, 5)}});
}

}  // namespace

Descriptor describe() {
  return {.number = 35,
          .name = "plugging",
          .blocks = {Block::transmitter},
          .parameters = {at_least_zero("rate", "s/s",
                                       "of a lag that grows from 0 at the start of the record")},
          .header = "plugging/plugging.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return Plugging(read.value("rate"), context.sample_time_s);
          },
          .candidates = candidates,
          .examples = {{"plugging", {"plugging", {{"rate", 0.04}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::plugging
