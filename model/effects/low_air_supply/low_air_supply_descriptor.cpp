// SPDX-License-Identifier: Apache-2.0
#include "model/effects/low_air_supply/low_air_supply.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::low_air_supply {
namespace {

Effect make(const SpecReader& read, const EffectContext& context) {
  using Filling = LowAirSupply::Filling;
  return LowAirSupply(
      {.rate = read.value("rate"),
       .travel_limit = read.value("travel_limit"),
       .lag_s = read.value("lag"),
       .filling = read.option("filling") == "one_sided" ? Filling::one_sided : Filling::both_ways,
       .closing = read.has("rate_closing") ? read.value("rate_closing") / read.value("rate") : 1.0,
       .preload = read.value("preload"),
       .shut = context.output_low},
      context.sample_time_s);
}

void check(const SpecReader& read, const EffectContext&) {
  if (read.has("rate_closing") && read.option("filling") == "one_sided") {
    throw EffectError("rate_closing", "rate_closing belongs to filling both_ways");
  }
}

// Returns the share of the samples at which the rate or the travel limit holds the stem back.
// Without such samples the effect is only a lag.
double held_back(const effects::LowAirSupply::Parameters& p, Candidate::Values co,
                 double period_s) {
  if (co.empty()) return 0.0;
  LowAirSupply air(p, period_s);
  double x = air.reset(co.front());
  std::size_t held = 0;
  for (const double u : co) {
    const double distance = std::min(u, p.travel_limit) - x;
    const double rate = distance > 0.0 ? p.rate : p.rate * p.closing;
    if (u > p.travel_limit || std::abs(distance) > rate * p.lag_s) ++held;
    x = air.step(u);
  }
  return static_cast<double>(held) / static_cast<double>(co.size());
}

double limited(Candidate::Values v, Candidate::Values co, double period_s) {
  return held_back({.rate = v[0], .travel_limit = v[1], .lag_s = v[2]}, co, period_s);
}

double limited_two_ways(Candidate::Values v, Candidate::Values co, double period_s) {
  return held_back({.rate = v[0], .lag_s = v[2], .closing = v[1]}, co, period_s);
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
  // The stem is slower in one direction, for example with a throttled exhaust or a leak in the
  // diaphragm.
  all.push_back(
      {.smooth = false,
       .parameters = 3,
       .prior_nats = 1.0,
       .search = {{"rate", 0.002 * c.span(), 0.5 * c.span(), true, 5},
                  {"closing", 0.04, 25.0, true, 4},
                  between("lag", 0.2 * c.period_s, 2.0 * c.slow_s(), true, 3)},
       .starts = 4,
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"low_air_supply", {{"rate", v[0]}, {"rate_closing", v[0] * v[1]}, {"lag", v[2]}}};
       },
       .telling = limited_two_ways,
       .deviations =
           [](Candidate::Values v, Candidate::Values spread, const EffectSpec&,
              Candidate::Deviations& named) {
             named["rate_closing"] = numeric::root_sum_square(v[1] * spread[0], v[0] * spread[1]);
           }});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 4,
      .name = "low_air_supply",
      .blocks = {Block::valve},
      .parameters =
          {above_zero("rate", "CO units/s", "fill rate"),
           optional(any_value("travel_limit", "CO units", "where the spring balances the supply"),
                    kInfinity),
           optional(at_least_zero("lag", "s", "time constant of the actuator volume"), 0.0),
           optional(above_zero("rate_closing", "CO units/s",
                               "rate on closing, if it differs; otherwise rate applies"),
                    kInfinity),
           optional(
               at_least_zero("preload", "CO units", "what the spring takes before the stem moves"),
               0.0)},
      .options = {{"filling",
                   {"both_ways", "one_sided"},
                   "one_sided: only the opening is limited"}},
      .header = "low_air_supply/low_air_supply.hpp",
      .check = check,
      .make = make,
      .candidates = candidates,
      .valve_rank = 2,
      .alarms = {"low_air_supply"},
      .examples = {{"low_air_supply",
                    {"low_air_supply", {{"rate", 0.08}, {"travel_limit", 4.6}, {"lag", 0.5}}},
                    Block::valve}}};
}

}  // namespace loopwarden::effects::low_air_supply
