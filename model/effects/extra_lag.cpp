// SPDX-License-Identifier: Apache-2.0
#include "model/effects/descriptor.hpp"
#include "model/plant/first_order_lag.hpp"

namespace loopwarden::effects::extra_lag {
namespace {

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.block = Block::process,
       .parameters = 1,
       .search = {between("time_constant", 0.2 * c.period_s, 5.0 * c.slow_s(), true, 7)},
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"extra_lag", {{"time_constant", v[0]}}};
       }});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 12,
      .name = "extra_lag",
      .blocks = {Block::process, Block::transmitter},
      .parameters = {at_least_zero("time_constant", "s", "of the first-order lag")},
      .header = "first_order_lag.hpp",
      .meaning = "one more lag than believed",
      .remedy =
          "Look at the transmitter's damping and filters first, then at a slow actuator; tune "
          "again if it stays.",
      .make = [](const SpecReader& read, const EffectContext& context) -> plant::Effect {
        return plant::FirstOrderLag(read.value("time_constant"), context.sample_time_s);
      },
      .candidates = candidates,
      .linear =
          [](const SpecReader& read) {
            return LinearPart{.lags_s = {read.value("time_constant")}};
          },
      .seen =
          "PV comes late and rounded; in the transmitter it also smooths the noise. A "
          "tight loop swings more.",
      .look_alikes =
          {{"extra_dead_time", "see there."},
           {"positioner_lag", "the same from CO to PV; a measured stem tells."},
           {"a longer time constant",
            "within the stated uncertainty of the process it is no effect; beyond it one more lag "
            "starts more gently than one longer lag."}},
      .examples = {{"extra_lag", {"extra_lag", {{"time_constant", 4.0}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::extra_lag
