// SPDX-License-Identifier: Apache-2.0
#include "model/effects/recycle/recycle.hpp"

#include <algorithm>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::recycle {
namespace {

constexpr double kMostShare = 0.95;
constexpr double kLongest = 1e6;  // samples

void check(const SpecReader& read, const EffectContext& context) {
  if (read.value("delay") > kLongest * context.sample_time_s) {
    throw EffectError(
        "delay", "delay must be at most " + number_text(kLongest * context.sample_time_s) + " s");
  }
}

// A return path as short as the process itself looks like another lag.
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  const SearchRange share{"share", 0.05, 0.8, false, 4};
  const SearchRange delay =
      between("delay", std::max(c.slow_s(), 2.0 * c.period_s), 0.2 * c.duration_s, true, 8);
  all.push_back({.block = Block::process,
                 .parameters = 2,
                 .prior_nats = 1.0,
                 .search = {share, delay},
                 .starts = 3});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 33,
      .name = "recycle",
      .blocks = {Block::process},
      .parameters = {{"share", "-", 0.0, false, kMostShare, false, true, 0.0,
                      "of the outflow that returns"},
                     at_least_zero("delay", "s", "of the return path"),
                     optional(at_least_zero("time_constant", "s", "of a lag in the return path"),
                              0.0)},
      .header = "recycle/recycle.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return Recycle(read.value("share"), read.value("delay"), read.value("time_constant"),
                       context.sample_time_s);
      },
      .candidates = candidates,
      .examples = {{"recycle", {"recycle", {{"share", 0.4}, {"delay", 25.0}}}, Block::process}}};
}

}  // namespace loopwarden::effects::recycle
