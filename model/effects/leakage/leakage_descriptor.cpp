// SPDX-License-Identifier: Apache-2.0
#include "model/effects/leakage/leakage.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::leakage {
namespace {

void check(const SpecReader& read, const EffectContext& context) {
  const double span = context.output_high - context.output_low;
  if (read.value("flow") > span) {
    refuse(read, "flow", "at most the output's span, " + number_text(span) + " CO units");
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.parameters = 1,
                 .prior_nats = 3.0,  // a bias or a gain that fits as well is more common
                 .search = {{"flow", 0.002 * c.span(), 0.6 * c.span(), true, 6}},
                 .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 19,
      .name = "leakage",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("flow", "CO units", "what passes when shut, at most the span")},
      .header = "leakage/leakage.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return Leakage(read.value("flow"), context.output_low, context.output_high);
      },
      .candidates = candidates,
      .valve_rank = 6,
      .alarms = {"unknown"},
      .examples = {{"leakage", {"leakage", {{"flow", 1.0}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::leakage
