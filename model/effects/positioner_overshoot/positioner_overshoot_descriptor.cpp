// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"

#include <algorithm>
#include <numbers>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::positioner_overshoot {
namespace {

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  // A faster actuator is that of a healthy valve.
  const double slowest_healthy = std::min(1.2 / (kFastActuator * c.slow_s()),
                                          0.5 * std::numbers::pi / c.period_s);  // rad/s
  all.push_back(
      {.parameters = 2,
       .search = {{"damping", 0.05, 0.95, false, 3},
                  between("natural_frequency", 0.1 / c.slow_s(), slowest_healthy, true, 7)},
       .telling = [](Candidate::Values v, Candidate::Values, double) {
         return v[0] < kLeastRinging ? 1.0 : 0.0;
       }});
}

}  // namespace

Descriptor describe() {
  return {.number = 8,
          .name = "positioner_overshoot",
          .blocks = {Block::valve},
          .parameters = {{"damping", "-", 0.0, true, 1.0, true, true, 0.0, "damping ratio"},
                         above_zero("natural_frequency", "rad/s", "undamped")},
          .header = "positioner_overshoot/positioner_overshoot.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return PositionerOvershoot(read.value("damping"), read.value("natural_frequency"),
                                       context.sample_time_s,
                                       {context.output_low, context.output_high});
          },
          .candidates = candidates,
          .valve_rank = 0,
          .alarms = {"unknown"},
          .examples = {{"positioner_overshoot",
                        {"positioner_overshoot", {{"damping", 0.1}, {"natural_frequency", 0.8}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::positioner_overshoot
