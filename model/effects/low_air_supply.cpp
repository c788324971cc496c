// SPDX-License-Identifier: Apache-2.0
#include "model/plant/low_air_supply.hpp"

#include <algorithm>
#include <cmath>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::low_air_supply {
namespace {

plant::Effect make(const SpecReader& read, const EffectContext& context) {
  using Filling = plant::LowAirSupply::Filling;
  return plant::LowAirSupply(
      {.rate = read.value("rate"),
       .travel_limit = read.value("travel_limit"),
       .lag_s = read.value("lag"),
       .filling = read.option("filling") == "one_sided" ? Filling::one_sided : Filling::both_ways,
       .preload = read.value("preload"),
       .shut = context.output_low},
      context.sample_time_s);
}

// Share of the samples at which rate or travel limit hold the stem back; without them it is a bare lag.
double limited(Candidate::Values v, Candidate::Values co, double period_s) {
  if (co.empty()) return 0.0;
  plant::LowAirSupply air({.rate = v[0], .travel_limit = v[1], .lag_s = v[2]}, period_s);
  double x = air.reset(co.front());
  std::size_t held = 0;
  for (const double u : co) {
    if (u > v[1] || std::abs(std::min(u, v[1]) - x) > v[0] * v[2]) ++held;
    x = air.step(u);
  }
  return static_cast<double>(held) / static_cast<double>(co.size());
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.smooth = false,
                 .parameters = 3,
                 .search = {{"rate", 0.002 * c.span(), 0.5 * c.span(), true, 5},
                            {"travel_limit",
                             std::min(c.output_used_low + 0.2 * c.used_span(),
                                      c.output_high - 0.02 * c.span()),
                             c.output_high, false, 4},
                            between("lag", 0.2 * c.period_s, 2.0 * c.slow_s(), true, 3)},
                 .starts = 4,
                 .telling = limited});
}

}  // namespace

Descriptor describe() {
  return {.number = 4,
          .name = "low_air_supply",
          .blocks = {Block::valve},
          .parameters = {above_zero("rate", "CO units/s", "fill rate"),
                         optional(any_value("travel_limit", "CO units",
                                            "where the spring balances the supply"),
                                  kInfinity),
                         optional(at_least_zero("lag", "s", "time constant of the actuator volume"),
                                  0.0),
                         optional(at_least_zero("preload", "CO units",
                                                "what the spring takes before the stem moves"),
                                  0.0)},
          .options = {{"filling",
                       {"both_ways", "one_sided"},
                       "one_sided: only the opening is limited"}},
          .header = "low_air_supply.hpp",
          .make = make,
          .candidates = candidates,
          .valve_rank = 2,
          .alarms = {"low_air_supply"},
          .examples = {{"low_air_supply",
                        {"low_air_supply", {{"rate", 0.08}, {"travel_limit", 4.6}, {"lag", 0.5}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::low_air_supply
