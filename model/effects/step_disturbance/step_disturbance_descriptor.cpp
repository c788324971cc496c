// SPDX-License-Identifier: Apache-2.0
#include "model/effects/step_disturbance/step_disturbance.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::step_disturbance {
namespace {

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  constexpr int kPlaces = 100;
  all.push_back({.block = Block::disturbance,
                 .smooth = false,
                 .parameters = 3,  // a moment counts as two (Zhang and Siegmund 2007)
                 .search = {{"time", 0.02 * c.duration_s, 0.98 * c.duration_s, false, kPlaces,
                             0.5 / kPlaces}},
                 .solved = {"size"},
                 .columns = 1,
                 .fill =
                     [](Candidate::Values v, double period_s, Candidate::Columns& columns) {
                       for (std::size_t k = 0; k < columns[0].size(); ++k) {
                         columns[0][k] = static_cast<double>(k) * period_s >= v[0] ? 1.0 : 0.0;
                       }
                     },
                 .shifts_pv = true,
                 .at_one_moment = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 16,
          .name = "step_disturbance",
          .blocks = {Block::disturbance},
          .parameters = {any_value("size", "PV units", "of the step"),
                         any_value("time", "s", "when it begins")},
          .header = "step_disturbance/step_disturbance.hpp",
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return StepDisturbance(read.value("size"), read.value("time"));
          },
          .candidates = candidates,
          .examples = {{"step_disturbance",
                        {"step_disturbance", {{"size", -0.6}, {"time", 150.0}}},
                        Block::disturbance}}};
}

}  // namespace loopwarden::effects::step_disturbance
