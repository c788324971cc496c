// SPDX-License-Identifier: Apache-2.0
#include "model/control/output_limiter.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {

Limited limit_output(const OutputLimits& limits, double wanted, double previous,
                     double period_s) noexcept {
  Limited result;
  result.output = std::clamp(wanted, limits.low, limits.high);
  result.at_low = wanted <= limits.low;
  result.at_high = wanted >= limits.high;

  if (std::abs(result.output - previous) < limits.deadband) {
    const bool at_limit = result.at_low || result.at_high;
    const bool was_inside = previous >= limits.low && previous <= limits.high;
    if (!at_limit && was_inside) result.output = previous;
  }

  const double step = limits.rate_per_s * period_s;
  const double reachable = std::clamp(result.output, previous - step, previous + step);
  result.rate_limited = reachable != result.output;
  result.output = reachable;
  return result;
}

}  // namespace loopwarden::control
