// SPDX-License-Identifier: Apache-2.0
#include "model/effects/extra_dead_time/extra_dead_time.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::extra_dead_time {
namespace {

constexpr double kLongest = 1e6;  // samples

void check(const SpecReader& read, const EffectContext& context) {
  if (read.value("seconds") > kLongest * context.sample_time_s) {
    throw EffectError("seconds", "seconds must be at most " +
                                     number_text(kLongest * context.sample_time_s) + " s");
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.block = Block::process,
                 .parameters = 1,
                 .search = {{"seconds", 0.0, 3.0 * c.slow_s(), false, 9}}});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 11,
      .name = "extra_dead_time",
      .blocks = {Block::process},
      .parameters = {at_least_zero("seconds", "s", "on top of the process's own")},
      .header = "extra_dead_time/extra_dead_time.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return ExtraDeadTime(read.value("seconds"), context.sample_time_s);
      },
      .candidates = candidates,
      .linear =
          [](const SpecReader& read) { return LinearPart{.dead_time_s = read.value("seconds")}; },
      .examples = {{"extra_dead_time", {"extra_dead_time", {{"seconds", 1.5}}}, Block::process}}};
}

}  // namespace loopwarden::effects::extra_dead_time
