// SPDX-License-Identifier: Apache-2.0
#include "model/effects/inverse_response/inverse_response.hpp"

#include <algorithm>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::inverse_response {
namespace {

// Returns 1 if the wrong-way response is large enough to distinguish the effect from a lag.
double reversals(Candidate::Values v, Candidate::Values, double period_s) {
  constexpr double kLeast = 0.1;  // of the lag
  return v[0] > std::max(2.0 * period_s, v.size() > 1 ? kLeast * v[1] : 0.0) ? 1.0 : 0.0;
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.block = Block::process,
                 .parameters = 1,
                 .prior_nats = 1.0,  // longer dead time is more common
                 .search = {between("zero_time", 0.02 * c.slow_s(), 3.0 * c.slow_s(), true, 6)},
                 .telling = reversals});
  all.push_back({.block = Block::process,
                 .parameters = 2,
                 .prior_nats = 1.0,
                 .search = {between("zero_time", 0.02 * c.slow_s(), 3.0 * c.slow_s(), true, 5),
                            between("lag", std::max(0.03 * c.slow_s(), 0.5 * c.period_s),
                                    0.7 * c.time_constant_s, true, 3)},
                 .telling = reversals});
}

}  // namespace

Descriptor describe() {
  return {.number = 23,
          .name = "inverse_response",
          .blocks = {Block::process},
          .parameters = {at_least_zero("zero_time", "s", "of the zero: times (1 - zero_time p)"),
                         optional(at_least_zero("lag", "s", "of the faster way: over (lag p + 1)"),
                                  0.0)},
          .header = "inverse_response/inverse_response.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return effects::InverseResponse(read.value("zero_time"), read.value("lag"),
                                            context.sample_time_s);
          },
          .candidates = candidates,
          .more_by = "zero_time",
          // Tuning rules treat such a zero as dead time (Skogestad, J. Process Control 13 (2003)
          // 291-309).
          .linear =
              [](const SpecReader& read) {
                LinearPart part{.dead_time_s = read.value("zero_time")};
                if (read.value("lag") > 0.0) part.lags_s.push_back(read.value("lag"));
                return part;
              },
          .examples = {{"inverse_response",
                        {"inverse_response", {{"zero_time", 1.0}}},
                        Block::process}}};
}

}  // namespace loopwarden::effects::inverse_response
