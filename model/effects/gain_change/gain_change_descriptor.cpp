// SPDX-License-Identifier: Apache-2.0
#include "model/effects/gain_change/gain_change.hpp"

#include <cmath>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::gain_change {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back({.block = Block::process,
                 .parameters = 1,
                 .solved = {"factor"},
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
      .header = "gain_change/gain_change.hpp",
      .make = [](const SpecReader& read, const EffectContext&) -> Effect {
        return GainChange(read.value("factor"));
      },
      .candidates = candidates,
      .linear =
          [](const SpecReader& read) { return LinearPart{.gain = std::abs(read.value("factor"))}; },
      .examples = {{"gain_change", {"gain_change", {{"factor", 1.4}}}, Block::process}}};
}

}  // namespace loopwarden::effects::gain_change
