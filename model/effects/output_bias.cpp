// SPDX-License-Identifier: Apache-2.0
#include "model/plant/output_bias.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::output_bias {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back(
      {.block = Block::transmitter,
       .parameters = 1,
       .spec = [](const Candidate&, Candidate::Values, Candidate::Values solved) -> EffectSpec {
         return {"output_bias", {{"bias", solved[0]}}};
       },
       .deviations = [](Candidate::Values, Candidate::Values spread, const EffectSpec&,
                        Candidate::Deviations& named) { named["bias"] = spread[0]; },
       .columns = 1,
       .shifts_pv = true,
       .is_level = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 13,
          .name = "output_bias",
          .blocks = {Block::transmitter},
          .parameters = {any_value("bias", "PV units", "added to PV")},
          .header = "output_bias.hpp",
          .meaning = "PV is off by a constant",
          .remedy =
              "Check the transmitter's zero, or look for a steady load; the controller's integral "
              "hides either.",
          .make = [](const SpecReader& read, const EffectContext&) -> plant::Effect {
            return plant::OutputBias(read.value("bias"));
          },
          .candidates = candidates,
          .seen = "The same loop at another CO: PV is off by a constant for the same CO.",
          .look_alikes = {{"a constant load", "can't be told apart by any record."},
                          {"gain_change", "grows with the distance from the calibration point."},
                          {"step_disturbance", "starts within the record."},
                          {"drift", "grows with time."}},
          .examples = {{"output_bias", {"output_bias", {{"bias", 0.4}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::output_bias
