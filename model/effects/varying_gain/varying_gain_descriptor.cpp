// SPDX-License-Identifier: Apache-2.0
#include "model/effects/varying_gain/varying_gain.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::varying_gain {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  const auto& table = read.spec().table;
  if (table.size() < 2 || table.size() > VaryingGain::kMostPoints) {
    throw EffectError("table", "table must have 2 to " + std::to_string(VaryingGain::kMostPoints) +
                                   " points (got " + std::to_string(table.size()) + ")");
  }
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::string point = " (see point " + std::to_string(i + 1) + ")";
    if (!std::isfinite(table[i].first) || !(i == 0 || table[i].first > table[i - 1].first)) {
      throw EffectError("table", "times in the table must rise" + point);
    }
    if (!std::isfinite(table[i].second) || !(table[i].second > 0.0)) {
      throw EffectError("table", "factors in the table must be above 0" + point);
    }
  }
}

Effect make(const SpecReader& read, const EffectContext&) {
  VaryingGain::Parameters p;
  for (const auto& [time_s, factor] : read.spec().table) {
    p.points[p.point_count++] = {time_s, factor};
  }
  return VaryingGain(p);
}

constexpr int kKnots = 5;

// Returns factors at evenly spaced times from the first to the last fitted sample. After that
// sample the last factor applies, because the record has no later information.
EffectSpec spec(const Candidate&, Candidate::Values v, Candidate::Values) {
  EffectSpec effect{"varying_gain"};
  for (int i = 0; i < kKnots; ++i) {
    effect.table.emplace_back(v[kKnots] * i / (kKnots - 1), v[static_cast<std::size_t>(i)]);
  }
  return effect;
}

// Returns 1 if the factors vary; a constant factor is only another gain.
double varies(Candidate::Values v, Candidate::Values, double) {
  constexpr double kLeast = 1.03;
  const auto [low, high] = std::minmax_element(v.begin(), v.begin() + kKnots);
  return *high > kLeast * *low ? 1.0 : 0.0;
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  Candidate candidate{.block = Block::process,
                      .parameters = kKnots,
                      .prior_nats = 6.0,  // so many factors follow any slow disturbance, too
                      .starts = 1,
                      .spec = spec,
                      .telling = varies,
                      .wanders_on = true};
  for (const char* name : {"factor_1", "factor_2", "factor_3", "factor_4", "factor_5"}) {
    candidate.search.push_back({name, 0.5, 2.0, true, 1, 0.02});
  }
  // Fixed, not searched: the end of the fitted part.
  candidate.search.push_back({"last", c.duration_s, c.duration_s * 1.001, false, 1});
  all.push_back(candidate);
}

}  // namespace

Descriptor describe() {
  return {
      .number = 27,
      .name = "varying_gain",
      .blocks = {Block::process},
      .takes_table = true,
      .table = {"[[t, factor], ...]", "s of the record and factor of the process gain, t rising"},
      .header = "varying_gain/varying_gain.hpp",
      .check = check,
      .make = make,
      .candidates = candidates,
      .examples = {{"varying_gain",
                    {"varying_gain", {}, {}, {{60.0, 1.0}, {180.0, 0.7}, {300.0, 1.1}}},
                    Block::process}}};
}

}  // namespace loopwarden::effects::varying_gain
