// SPDX-License-Identifier: Apache-2.0
#include "model/effects/descriptor.hpp"
#include "model/effects/first_order_lag.hpp"

namespace loopwarden::effects::extra_lag {
namespace {

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.block = Block::process,
       .parameters = 1,
       .search = {between("time_constant", 0.2 * c.period_s, 5.0 * c.slow_s(), true, 7)}});
}

}  // namespace

Descriptor describe() {
  return {.number = 12,
          .name = "extra_lag",
          .blocks = {Block::process, Block::transmitter},
          .parameters = {at_least_zero("time_constant", "s", "of the first-order lag")},
          .header = "first_order_lag.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return FirstOrderLag(read.value("time_constant"), context.sample_time_s);
          },
          .candidates = candidates,
          .linear =
              [](const SpecReader& read) {
                return LinearPart{.lags_s = {read.value("time_constant")}};
              },
          .examples = {{"extra_lag", {"extra_lag", {{"time_constant", 4.0}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::extra_lag
