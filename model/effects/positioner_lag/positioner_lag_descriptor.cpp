// SPDX-License-Identifier: Apache-2.0
#include "model/effects/descriptor.hpp"
#include "model/effects/first_order_lag.hpp"

namespace loopwarden::effects::positioner_lag {

Descriptor describe() {
  return {
      .number = 9,
      .name = "positioner_lag",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("time_constant", "s", "of the first-order lag")},
      .header = "first_order_lag.hpp",
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return FirstOrderLag(read.value("time_constant"), context.sample_time_s);
      },
      .valve_rank = 1,
      .linear =
          [](const SpecReader& read) {
            return LinearPart{.lags_s = {read.value("time_constant")}};
          },
      .alarms = {"unknown"},
      .examples = {{"positioner_lag", {"positioner_lag", {{"time_constant", 3.0}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::positioner_lag
