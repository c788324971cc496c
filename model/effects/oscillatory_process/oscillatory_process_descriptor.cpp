// SPDX-License-Identifier: Apache-2.0
#include "model/effects/oscillatory_process/oscillatory_process.hpp"

#include <algorithm>
#include <numbers>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::oscillatory_process {
namespace {

double time_constant_s(const SpecReader& read, const EffectContext& context) {
  return read.has("time_constant") ? read.value("time_constant") : context.time_constant_s;
}

void check(const SpecReader& read, const EffectContext& context) {
  const double highest = std::numbers::pi / context.sample_time_s;
  if (!(read.value("natural_frequency") < highest)) {
    refuse(read, "natural_frequency",
           "below " + number_text(highest) + " rad/s, half the sampling rate");
  }
  if (!(time_constant_s(read, context) > 0.0)) {
    throw EffectError("time_constant", "time_constant of the lag that it replaces is missing");
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  const double high = std::min(6.0 / c.time_constant_s, 0.9 * std::numbers::pi / c.period_s);
  all.push_back({.block = Block::process,
                 .parameters = 2,
                 .prior_nats = 2.0,  // one more lag or dead time is more common
                 .search = {{"damping", 0.05, 0.95, true, 3},
                            {"natural_frequency", std::min(0.15 / c.time_constant_s, 0.5 * high),
                             high, true, 7}},
                 .spec = [](const Candidate& candidate, Candidate::Values v,
                            Candidate::Values) -> EffectSpec {
                   return {"oscillatory_process",
                           {{"damping", v[0]},
                            {"natural_frequency", v[1]},
                            {"time_constant", candidate.time_constant_s}}};
                 },
                 .telling = [](Candidate::Values v, Candidate::Values,
                               double) { return v[0] < kLeastRinging ? 1.0 : 0.0; }});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 26,
      .name = "oscillatory_process",
      .blocks = {Block::process},
      .parameters = {{"damping", "-", 0.0, true, 1.0, true, true, 0.0, "ratio"},
                     above_zero("natural_frequency", "rad/s", "undamped"),
                     of_the_law(as_process_lag(
                         optional(above_zero("time_constant", "s", "of the lag that it replaces"),
                                  kInfinity)))},
      .header = "oscillatory_process/oscillatory_process.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
        return OscillatoryProcess(read.value("damping"), read.value("natural_frequency"),
                                  time_constant_s(read, context), context.sample_time_s);
      },
      .candidates = candidates,
      .examples = {{"oscillatory_process",
                    {"oscillatory_process",
                     {{"damping", 0.25}, {"natural_frequency", 0.5}, {"time_constant", 1.69376}}},
                    Block::process}}};
}

}  // namespace loopwarden::effects::oscillatory_process
