// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/step_curve.hpp"

#include <cmath>

namespace loopwarden::fleet {

std::vector<double> step_curve(const std::vector<StepRow>& rows, std::size_t steps) {
  std::vector<double> curve(steps, kNotKnown);
  double before = kNotKnown;
  auto row = rows.begin();
  for (; row != rows.end() && row->step < 0; ++row) before = row->last;
  for (std::size_t i = 0; i < steps; ++i) {
    curve[i] = before;
    if (row == rows.end() || static_cast<std::size_t>(row->step) != i) continue;
    curve[i] = std::fmax(before, row->high);
    before = row->last;
    ++row;
  }
  return curve;
}

}  // namespace loopwarden::fleet
