// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <algorithm>

#include "model/gap/constants.hpp"

namespace loopwarden::gap {

double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept {
  if (!(before_rmse >= kGapFloors * floor_rmse) || !(before_rmse > 0.0)) return kNone;
  const double before = before_rmse * before_rmse;
  const double closed = (before - after_rmse * after_rmse) / (before - floor_rmse * floor_rmse);
  return std::clamp(closed, -1.0, 1.0);
}

}  // namespace loopwarden::gap
