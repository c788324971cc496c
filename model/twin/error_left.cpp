// SPDX-License-Identifier: Apache-2.0
#include "model/twin/error_left.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::twin {
namespace {

constexpr double kGapFloors = 2.0;
constexpr double kFewestFloors = 3.0;  // of the movement, for a percentage of fit

}  // namespace

gap::Misfit error_left(const std::vector<double>& pv, const std::vector<double>& run,
                       const std::vector<bool>& used, std::size_t fitted, double floor) {
  struct Part {
    double rmse, moves;
  };
  const auto part = [&](std::size_t begin, std::size_t end) -> Part {
    double count = 0.0, sum = 0.0, squares = 0.0, errors = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
      if (!used[k]) continue;
      count += 1.0;
      sum += pv[k];
      squares += pv[k] * pv[k];
      errors += (pv[k] - run[k]) * (pv[k] - run[k]);
    }
    if (count == 0.0) return {gap::kNone, 0.0};
    return {std::sqrt(errors / count),
            std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)))};
  };
  const auto percent = [&](const Part& p) {
    return p.moves >= kFewestFloors * floor ? 100.0 * (1.0 - p.rmse / p.moves) : gap::kNone;
  };
  const Part all = part(0, pv.size());
  const Part holdout = part(fitted, pv.size());
  return {all.rmse, percent(all), part(0, fitted).rmse, holdout.rmse, percent(holdout)};
}

double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept {
  if (!(before_rmse >= kGapFloors * floor_rmse) || !(before_rmse > 0.0)) return gap::kNone;
  const double before = before_rmse * before_rmse;
  const double closed = (before - after_rmse * after_rmse) / (before - floor_rmse * floor_rmse);
  return std::clamp(closed, -1.0, 1.0);
}

}  // namespace loopwarden::twin
