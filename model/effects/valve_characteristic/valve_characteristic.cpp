// SPDX-License-Identifier: Apache-2.0
#include "model/effects/valve_characteristic/valve_characteristic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/effects/point_table.hpp"

namespace loopwarden::effects {

ValveCharacteristic::ValveCharacteristic(const Parameters& parameters, double low,
                                         double high) noexcept
    : parameters_(parameters),
      low_(low),
      high_(high),
      log_range_(std::log(parameters.rangeability)) {}

double ValveCharacteristic::flow(double x) const noexcept {
  if (parameters_.curve == Curve::table) {
    return on_lines(parameters_.points, parameters_.point_count, x);
  }
  const double span = high_ - low_;
  const double h = std::clamp((x - low_) / span, 0.0, 1.0);
  double share = h;
  switch (parameters_.curve) {
    case Curve::equal_percentage:
      share = std::expm1(log_range_ * h) / (parameters_.rangeability - 1.0);
      break;
    case Curve::quick_opening: share = std::sqrt(h); break;
    case Curve::butterfly: share = 1.0 - std::cos(std::numbers::pi / 2.0 * h); break;
    case Curve::linear:
    case Curve::table: break;
  }
  return low_ + span * share;
}

}  // namespace loopwarden::effects
