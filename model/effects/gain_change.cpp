// SPDX-License-Identifier: Apache-2.0
#include "model/plant/gain_change.hpp"

#include <cmath>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::gain_change {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back(
      {.block = Block::process,
       .parameters = 1,
       .spec = [](const Candidate&, Candidate::Values, Candidate::Values solved) -> EffectSpec {
         return {"gain_change", {{"factor", solved[0]}}};
       },
       .deviations = [](Candidate::Values, Candidate::Values spread, const EffectSpec&,
                        Candidate::Deviations& named) { named["factor"] = spread[0]; },
       .solves_gain = true,
       .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 10,
      .name = "gain_change",
      .blocks = {Block::process},
      .parameters = {above_zero("factor", "-", "1: no change")},
      .header = "gain_change.hpp",
      .meaning = "the process gain is another than believed",
      .remedy =
          "Check the range of the transmitter, upstream pressure and the valve's trim; divide the "
          "controller's gain by the factor.",
      .make = [](const SpecReader& read, const EffectContext&) -> plant::Effect {
        return plant::GainChange(read.value("factor"));
      },
      .candidates = candidates,
      .linear =
          [](const SpecReader& read) { return LinearPart{.gain = std::abs(read.value("factor"))}; },
      .seen =
          "PV moves too far or not far enough, by the same factor for every move. The "
          "residual is a straight line over CO.",
      .look_alikes = {{"valve_characteristic",
                       "the factor changes with the opening: try a wider range of CO."},
                      {"output_bias",
                       "a constant offset. While CO stays near one value the two are the same."},
                      {"step_disturbance", "comes on at one moment."}},
      .examples = {{"gain_change", {"gain_change", {{"factor", 1.4}}}, Block::process}}};
}

}  // namespace loopwarden::effects::gain_change
