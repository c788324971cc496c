// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/reversals.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/enum_name.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

double quartile_range(const Series& x) {
  return numeric::quantile(x, 0.75) - numeric::quantile(x, 0.25);
}

double scatter(const Series& x) {
  const double middle = numeric::median(x);
  return x.size() < 2 || middle <= 0.0 ? 0.0 : quartile_range(x) / middle;
}

}  // namespace

const char* to_text(ReversalsBy by) noexcept {
  return numeric::enum_name<ReversalsBy::clockwork>(by, {"neither", "travel", "time", "clockwork"});
}

std::vector<std::size_t> turning_points(std::span<const double> x, double depth) {
  std::vector<std::size_t> reversals;
  std::size_t low = 0;
  std::size_t high = 0;
  int direction = 0;
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (x[k] < x[low]) low = k;
    if (x[k] > x[high]) high = k;
    if (direction >= 0 && x[high] - x[k] > depth) {
      reversals.push_back(high);
      direction = -1;
      low = k;
    } else if (direction <= 0 && x[k] - x[low] > depth) {
      reversals.push_back(low);
      direction = 1;
      high = k;
    }
  }
  return reversals;
}

ReversalsBy Reversals::by() const noexcept {
  if (count < Limits::kLeastReversals) return ReversalsBy::neither;
  const bool forgets =
      four_cycle_scatter > std::max(Limits::kForgetsPhase * cycle_scatter, Limits::kLeastForgotten);
  if (cycle_scatter < Limits::kClockwork) {
    const bool known = four_cycle_scatter > 0.0 && count >= Limits::kLeastForClockwork;
    return known && !forgets ? ReversalsBy::clockwork : ReversalsBy::neither;
  }
  if (cycle_scatter > Limits::kByTravelFrom * travel_scatter &&
      travel_scatter < Limits::kSteadyTravel) {
    return ReversalsBy::travel;
  }
  if (count >= Limits::kLeastForTime && cycle_scatter < Limits::kSteadyCycle &&
      cycle_scatter <
          (forgets ? Limits::kByTimeForgetting : Limits::kByTimeBelow) * travel_scatter) {
    return ReversalsBy::time;
  }
  return ReversalsBy::neither;
}

bool Reversals::cycles() const noexcept {
  return by() == ReversalsBy::travel ||
         (count >= Limits::kLeastReversals && cycle_scatter < Limits::kSteadyCycle);
}

Reversals find_reversals(std::span<const double> co) {
  const Series u = medians_of_three(co);
  Reversals found;
  if (u.empty()) return found;
  const double range = numeric::quantile(u, 0.98) - numeric::quantile(u, 0.02);
  if (range <= 0.0) return found;
  const std::vector<std::size_t> at = turning_points(u, Limits::kReversalDepth * range);
  // The first turn may be no turn, and the last run is cut off.
  if (at.size() < Limits::kLeastReversals + 1) return found;
  found.count = at.size() - 1;
  std::array<Series, 2> travels;
  Series cycles;
  Series fours;
  for (std::size_t i = 1; i + 1 < at.size(); ++i) {
    travels[i % 2].push_back(std::abs(u[at[i + 1]] - u[at[i]]));
    if (i + 2 < at.size()) cycles.push_back(static_cast<double>(at[i + 2] - at[i]));
    if (i + 8 < at.size()) fours.push_back(static_cast<double>(at[i + 8] - at[i]));
  }
  found.travel_scatter = std::hypot(scatter(travels[0]), scatter(travels[1])) / std::sqrt(2.0);
  found.cycle_scatter = scatter(cycles);
  // A scatter of exactly 0 is a valid result too.
  if (fours.size() >= Limits::kLeastFours) {
    found.four_cycle_scatter =
        std::max(quartile_range(fours) / numeric::median(cycles), Limits::kLeastScatter);
  }
  return found;
}

}  // namespace loopwarden::diagnosis
