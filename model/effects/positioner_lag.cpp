// SPDX-License-Identifier: Apache-2.0
#include "model/effects/descriptor.hpp"
#include "model/plant/first_order_lag.hpp"

namespace loopwarden::effects::positioner_lag {

Descriptor describe() {
  return {
      .number = 9,
      .name = "positioner_lag",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("time_constant", "s", "of the first-order lag")},
      .header = "first_order_lag.hpp",
      .meaning = "the stem follows CO with a first-order lag",
      .remedy = "Check air supply and boosters; lower the positioner's damping.",
      .make = [](const SpecReader& read, const EffectContext& context) -> plant::Effect {
        return plant::FirstOrderLag(read.value("time_constant"), context.sample_time_s);
      },
      .valve_rank = 1,
      .linear =
          [](const SpecReader& read) {
            return LinearPart{.lags_s = {read.value("time_constant")}};
          },
      .alarms = {"unknown"},
      .seen =
          "PV comes late and rounded after each move of CO, in proportion to the move; the "
          "residual dies out exponentially.",
      .look_alikes =
          {{"extra_lag",
            "the same from CO to PV: linear lags in a row can't be told apart by their order. A "
            "measured stem tells."},
           {"low_air_supply", "one speed for all steps; a lag is faster for a larger step."},
           {"extra_dead_time", "PV keeps its shape; a lag rounds it."}},
      .examples = {{"positioner_lag", {"positioner_lag", {{"time_constant", 3.0}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::positioner_lag
