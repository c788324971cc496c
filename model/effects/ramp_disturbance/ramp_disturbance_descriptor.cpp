// SPDX-License-Identifier: Apache-2.0
#include "model/effects/ramp_disturbance/ramp_disturbance.hpp"

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::ramp_disturbance {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (!(read.value("to") > read.value("from"))) {
    refuse(read, "to", "after from = " + number_text(read.value("from")) + " s");
  }
}

// The searched parameters are the middle and the length. Shorter ramps are found as steps and
// longer ones as drift.
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  constexpr int kPlaces = 40;
  all.push_back(
      {.block = Block::disturbance,
       .parameters = 4,    // a size and two moments
       .prior_nats = 2.0,  // a step and a drift are more common
       .search = {{"middle", 0.05 * c.duration_s, 0.95 * c.duration_s, false, kPlaces,
                   0.5 / kPlaces},
                  {"length", 0.06 * c.duration_s, 0.8 * c.duration_s, true, 1}},
       .starts = 3,
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values solved) -> EffectSpec {
         return {"ramp_disturbance",
                 {{"size", solved[0]}, {"from", v[0] - v[1] / 2.0}, {"to", v[0] + v[1] / 2.0}}};
       },
       .deviations =
           [](Candidate::Values, Candidate::Values spread, const EffectSpec&,
              Candidate::Deviations& named) {
             named["size"] = spread[2];
             named["from"] = named["to"] = numeric::root_sum_square(spread[0], spread[1] / 2.0);
           },
       .columns = 1,
       .fill =
           [](Candidate::Values v, double period_s, Candidate::Columns& columns) {
             RampDisturbance one(1.0, v[0] - v[1] / 2.0, v[0] + v[1] / 2.0);
             for (std::size_t k = 0; k < columns[0].size(); ++k) {
               columns[0][k] = one.step(0.0, static_cast<double>(k) * period_s);
             }
           },
       .shifts_pv = true,
       .at_one_moment = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 24,
          .name = "ramp_disturbance",
          .blocks = {Block::disturbance},
          .parameters = {any_value("size", "PV units", "reached at its end, stays"),
                         any_value("from", "s", "when it begins"),
                         any_value("to", "s", "when it ends, after from")},
          .header = "ramp_disturbance/ramp_disturbance.hpp",
          .check = check,
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return RampDisturbance(read.value("size"), read.value("from"), read.value("to"));
          },
          .candidates = candidates,
          .examples = {{"ramp_disturbance",
                        {"ramp_disturbance", {{"size", -0.8}, {"from", 100.0}, {"to", 180.0}}},
                        Block::disturbance}}};
}

}  // namespace loopwarden::effects::ramp_disturbance
