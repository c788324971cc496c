// SPDX-License-Identifier: Apache-2.0
#include "model/effects/square_disturbance/square_disturbance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::square_disturbance {
namespace {

using std::numbers::pi;

// Half a turn of phase changes the sign of the solved amplitude.
EffectSpec spec(const Candidate&, Candidate::Values v, Candidate::Values solved) {
  const double phase = solved[0] < 0.0 ? v[1] + pi : v[1];
  return {"square_disturbance",
          {{"amplitude", std::abs(solved[0])},
           {"period", v[0]},
           {"phase", std::remainder(phase, 2.0 * pi)}}};
}

// The grid covers only the period, so half a turn of phase is divided into parts with one candidate
// each. A candidate starts at the last phase of its part. Until the grid has set the phase, any
// larger phase counts as that last phase.
constexpr int kParts = 4;
constexpr double last_phase(int part) { return (part + 1) * pi / kParts; }

template <int part>
void fill(Candidate::Values v, double period_s, Candidate::Columns& columns) {
  SquareDisturbance one(1.0, v[0], std::min(v[1], last_phase(part)), period_s);
  for (std::size_t k = 0; k < columns[0].size(); ++k) {
    columns[0][k] = one.step(0.0, static_cast<double>(k) * period_s);
  }
}

template <int part>
Candidate candidate(const SearchContext& c) {
  const double shortest = std::max(8.0 * c.period_s, 1.5 * c.slow_s());  // s
  SearchRange period =
      between("period", std::min(shortest, 0.2 * c.duration_s), 0.7 * c.duration_s, true, 150);
  period.is_period = true;
  return {
      .block = Block::disturbance,
      .smooth = false,
      .parameters = 5,    // as for a sine
      .prior_nats = 2.0,  // a sine is more common
      .search = {period, {"phase", last_phase(part) - 0.6 * pi, last_phase(part), false, 1, 0.15}},
      .starts = 4,
      .solved = {"amplitude"},
      .spec = spec,
      .columns = 1,
      .fill = fill<part>,
      .shifts_pv = true};
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(candidate<0>(c));
  all.push_back(candidate<1>(c));
  all.push_back(candidate<2>(c));
  all.push_back(candidate<3>(c));
}

}  // namespace

Descriptor describe() {
  return {.number = 25,
          .name = "square_disturbance",
          .blocks = {Block::disturbance},
          .parameters = {at_least_zero("amplitude", "PV units", "half of what it switches"),
                         above_zero("period", "s", "of switching on and off"),
                         optional(any_value("phase", "rad", "at the start of the record"), 0.0)},
          .header = "square_disturbance/square_disturbance.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return SquareDisturbance(read.value("amplitude"), read.value("period"),
                                     read.value("phase"), context.sample_time_s);
          },
          .candidates = candidates,
          .examples = {{"square_disturbance",
                        {"square_disturbance", {{"amplitude", 0.3}, {"period", 50.0}}},
                        Block::disturbance}}};
}

}  // namespace loopwarden::effects::square_disturbance
