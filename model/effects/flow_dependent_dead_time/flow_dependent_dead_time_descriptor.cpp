// SPDX-License-Identifier: Apache-2.0
#include "model/effects/flow_dependent_dead_time/flow_dependent_dead_time.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::flow_dependent_dead_time {
namespace {

double nominal(const SpecReader& read, const EffectContext& context) {
  return read.has("nominal") ? read.value("nominal")
                             : (context.output_low + context.output_high) / 2.0;
}

void check(const SpecReader& read, const EffectContext& context) {
  if (!(nominal(read, context) > 0.0)) {
    throw EffectError("nominal",
                      "nominal must be above 0 CO units: the middle of the output range is not");
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  if (c.dead_time_s < 2.0 * c.period_s || c.output_used_high <= 0.0) return;
  // Flows below a tenth of the nominal flow count as a tenth.
  const double low = std::max(c.output_used_low, 0.1 * c.output_used_high);
  all.push_back({.block = Block::process,
                 .parameters = 2,
                 .prior_nats = 2.0,  // another dead time or a lag is more common
                 .search = {{"exponent", 0.2, 2.0, true, 3},
                            between("nominal", low, c.output_used_high, true, 6)}});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 29,
      .name = "flow_dependent_dead_time",
      .blocks = {Block::process},
      .parameters =
          {{"exponent", "-", 0.0, false, 3.0, false, true, 0.0,
            "dead time is proportional to flow^-exponent; 1: plug flow"},
           optional(
               above_zero("nominal", "CO units",
                          "flow at which the dead time at rest is the process's own; default: the "
                          "middle of the output range"),
               kInfinity)},
      .header = "flow_dependent_dead_time/flow_dependent_dead_time.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return FlowDependentDeadTime(context.dead_time_s, read.value("exponent"),
                                     nominal(read, context), context.sample_time_s);
      },
      .takes_dead_time = true,
      .candidates = candidates,
      .examples = {{"flow_dependent_dead_time",
                    {"flow_dependent_dead_time", {{"exponent", 1.0}, {"nominal", 5.0}}},
                    Block::process}}};
}

}  // namespace loopwarden::effects::flow_dependent_dead_time
