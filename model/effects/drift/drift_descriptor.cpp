// SPDX-License-Identifier: Apache-2.0
#include "model/effects/drift/drift.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::drift {
namespace {

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back({.block = Block::transmitter,
                 .parameters = 1,
                 .solved = {"rate"},
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
          .header = "drift/drift.hpp",
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return Drift(read.value("rate"));
          },
          .candidates = candidates,
          .examples = {{"drift", {"drift", {{"rate", -0.003}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::drift
