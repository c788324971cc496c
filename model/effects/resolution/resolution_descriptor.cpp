// SPDX-License-Identifier: Apache-2.0
#include "model/effects/resolution/resolution.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::resolution {
namespace {

// A loop hunts about one edge of the staircase. An error of 0.1 % in the step moves that edge, so
// the grid has many points. Finer staircases have a smaller effect than the friction of a healthy
// valve.
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  constexpr int kPlaces = 800;
  all.push_back(
      {.smooth = false,
       .parameters = 3,    // one number sets all edges, as a frequency sets all waves
       .prior_nats = 2.0,  // rarer than friction
       .search = {{"step", 0.02 * c.span(), 0.15 * c.span(), true, kPlaces, 0.5 / kPlaces}},
       .starts = 3});
}

}  // namespace

Descriptor describe() {
  return {.number = 22,
          .name = "resolution",
          .blocks = {Block::valve},
          .parameters = {at_least_zero("step", "CO units",
                                       "between two places where the stem can rest")},
          .header = "resolution/resolution.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return Resolution(read.value("step"), context.output_low);
          },
          .candidates = candidates,
          .valve_rank = 1,
          .resting_band = [](const SpecReader& read) { return read.value("step") / 2.0; },
          .alarms = {"stiction"},
          .examples = {{"resolution", {"resolution", {{"step", 0.6}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::resolution
