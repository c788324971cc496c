// SPDX-License-Identifier: Apache-2.0
#include "model/effects/backlash/backlash.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::backlash {
namespace {

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.smooth = false,
                 .parameters = 1,
                 .search = {{"deadband", 0.005 * c.span(), 0.5 * c.span(), true, 10}, kStart},
                 .resting_half_band = [](Candidate::Values v) { return v[0] / 2.0; },
                 .friction = true});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 2,
      .name = "backlash",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("deadband", "CO units", "all that CO loses on a reversal")},
      .header = "backlash/backlash.hpp",
      .make = [](const SpecReader& read, const EffectContext&) -> Effect {
        return Backlash(read.value("deadband"));
      },
      .candidates = candidates,
      .resting_band = [](const SpecReader& r) { return r.value("deadband") / 2.0; },
      .valve_band =
          [](const SpecReader& r) { return ValveBand{.backlash = true, .s = r.value("deadband")}; },
      .alarms = {"backlash", "hysteresis"},
      .examples = {{"backlash", {"backlash", {{"deadband", 0.8}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::backlash
