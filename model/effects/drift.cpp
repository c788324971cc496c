// SPDX-License-Identifier: Apache-2.0
#include "model/plant/drift.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::drift {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back(
      {.block = Block::transmitter,
       .parameters = 1,
       .spec = [](const Candidate&, Candidate::Values, Candidate::Values solved) -> EffectSpec {
         return {"drift", {{"rate", solved[0]}}};
       },
       .deviations = [](Candidate::Values, Candidate::Values spread, const EffectSpec&,
                        Candidate::Deviations& named) { named["rate"] = spread[0]; },
       .columns = 1,
       .fill =
           [](Candidate::Values, double period_s, Candidate::Columns& columns) {
             for (std::size_t k = 0; k < columns[0].size(); ++k) {
               columns[0][k] = static_cast<double>(k) * period_s;
             }
           },
       .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 14,
          .name = "drift",
          .blocks = {Block::transmitter},
          .parameters = {any_value("rate", "PV units/s", "from the start of the record")},
          .header = "drift.hpp",
          .meaning = "PV drifts off steadily",
          .remedy =
              "Check the transmitter's zero against a reference; look for coating, plugged impulse "
              "lines, or a load that grows.",
          .make = [](const SpecReader& read, const EffectContext&) -> plant::Effect {
            return plant::Drift(read.value("rate"));
          },
          .candidates = candidates,
          .seen =
              "At a constant set point CO creeps: the controller makes up for what the "
              "transmitter loses.",
          .look_alikes = {{"random_load", "wanders back; a drift never does."},
                          {"step_disturbance", "comes on within moments."},
                          {"output_bias",
                           "does not grow. A short record can't tell a slow drift from it."}},
          .examples = {{"drift", {"drift", {{"rate", -0.003}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::drift
