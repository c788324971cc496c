// SPDX-License-Identifier: Apache-2.0
#include "model/effects/creep/creep.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::creep {
namespace {

// Returns the share of the samples at which part of the move is immediate. Without such samples the
// effect is only a lag.
double limited(Candidate::Values v, Candidate::Values co, double period_s) {
  if (co.empty()) return 0.0;
  Creep creep(v[0], v[1], period_s);
  creep.reset(co.front());
  std::size_t count = 0;
  for (const double u : co) {
    creep.step(u);
    if (creep.limited()) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(co.size());
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.parameters = 2,
       .prior_nats = 2.0,  // rarer than lag and backlash, which look alike if CO moves often
       .search = {{"amount", 0.005 * c.span(), 0.1 * c.span(), true, 5},
                  between("time_constant", std::max(0.5 * c.slow_s(), 2.0 * c.period_s),
                          0.3 * c.duration_s, true, 5)},
       .telling = limited});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 32,
      .name = "creep",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("amount", "CO units", "greatest part of a move that is late"),
                     above_zero("time_constant", "s", "of the late part")},
      .header = "creep/creep.hpp",
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return Creep(read.value("amount"), read.value("time_constant"), context.sample_time_s);
      },
      .candidates = candidates,
      .alarms = {"unknown"},
      .examples = {{"creep", {"creep", {{"amount", 0.5}, {"time_constant", 15.0}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::creep
