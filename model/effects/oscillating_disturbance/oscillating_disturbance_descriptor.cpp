// SPDX-License-Identifier: Apache-2.0
#include "model/effects/oscillating_disturbance/oscillating_disturbance.hpp"

#include <cmath>
#include <numbers>

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::oscillating_disturbance {
namespace {

EffectSpec spec(const Candidate&, Candidate::Values v, Candidate::Values solved) {
  return {"oscillating_disturbance",
          {{"amplitude", numeric::root_sum_square(solved[0], solved[1])},
           {"period", v[0]},
           {"phase", std::atan2(solved[1], solved[0])}}};
}

void deviations(Candidate::Values, Candidate::Values spread, const EffectSpec& found,
                Candidate::Deviations& named) {
  named["amplitude"] = std::max(spread[1], spread[2]);
  const double amplitude = found.parameters.at("amplitude");
  named["phase"] = amplitude > 0.0 ? named["amplitude"] / amplitude : std::numbers::pi;
}

// The columns are sine and cosine, so that amplitude and phase are solved for.
void fill(Candidate::Values v, double period_s, Candidate::Columns& columns) {
  for (std::size_t k = 0; k < columns[0].size(); ++k) {
    const double angle = 2.0 * std::numbers::pi * (static_cast<double>(k) * period_s) / v[0];
    columns[0][k] = std::sin(angle);
    columns[1][k] = std::cos(angle);
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  SearchRange period = between("period", 4.0 * c.period_s, 0.5 * c.duration_s, true, 400);
  period.is_period = true;
  all.push_back({.block = Block::disturbance,
                 .smooth = false,
                 .parameters = 5,  // a frequency counts as three parameters (Djuric 1996)
                 .search = {period},
                 .spec = spec,
                 .deviations = deviations,
                 .columns = 2,
                 .fill = fill,
                 .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 15,
          .name = "oscillating_disturbance",
          .blocks = {Block::disturbance},
          .parameters = {at_least_zero("amplitude", "PV units", "of the sine"),
                         above_zero("period", "s", "of the sine"),
                         optional(any_value("phase", "rad", "at the start of the record"), 0.0)},
          .header = "oscillating_disturbance/oscillating_disturbance.hpp",
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return OscillatingDisturbance(read.value("amplitude"), read.value("period"),
                                          read.value("phase"));
          },
          .candidates = candidates,
          .examples = {{"oscillating_disturbance",
                        {"oscillating_disturbance", {{"amplitude", 0.3}, {"period", 35.0}}},
                        Block::disturbance}}};
}

}  // namespace loopwarden::effects::oscillating_disturbance
