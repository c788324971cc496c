// SPDX-License-Identifier: Apache-2.0
#include "model/gap/logger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

#include "model/gap/record_check.hpp"
#include "model/numeric/two_columns.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::gap {
namespace {

constexpr int kFurthest = 3;          // samples
constexpr double kClear = 0.25;       // of what the controller's law leaves unshifted
constexpr double kLaw = 0.3;          // of the moves of CO
constexpr std::size_t kFewest = 200;  // samples
constexpr std::size_t kParts = 10;
constexpr std::size_t kAgreeing = 8;

// What the law leaves of the moves of CO when it is `late`, as a share of their squares.
double left_by_law(const LoopRecord& r, const control::PidSettings& pid, int late) {
  const double margin = 0.005 * pid.output_span();
  const auto inside = [&](double u) {
    return u > pid.output_low + margin && u < pid.output_high - margin;
  };
  numeric::TwoColumns sums;
  for (std::size_t k = kFurthest + 1; k + kFurthest < r.size(); ++k) {
    const std::size_t at =
        late >= 0 ? k - static_cast<std::size_t>(late) : k + static_cast<std::size_t>(-late);
    const double e = r.sp[at] - r.pv[at];
    const double a = e - (r.sp[at - 1] - r.pv[at - 1]);
    const double y = r.co[k] - r.co[k - 1];
    if (!std::isfinite(a) || !std::isfinite(y) || !inside(r.co[k]) || !inside(r.co[k - 1]))
      continue;
    sums.add(a, e, y);
  }
  if (sums.count < kFewest || !(sums.yy > 0.0) || sums.depends(1e-12)) return 1.0;
  return sums.left() / sums.yy;
}

// Sums of squares of what the model's PV misses, by its changes over a time constant, part by part.
std::array<double, kParts> missed(const LoopRecord& r, plant::LoopModel model) {
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  model.disturbances.clear();
  const std::vector<double> co = held(r.co);
  plant::Plant plant(model, 1);
  plant.reset(co.front());
  std::vector<double> left;
  for (std::size_t k = 0; k < r.size(); ++k) {
    left.push_back(r.pv[k] - plant.process_variable());
    plant.step(co[k]);
  }
  const auto lag = static_cast<std::size_t>(
      std::max(2.0, std::nearbyint(model.process.time_constant_s / r.period_s)));
  std::array<double, kParts> sums{};
  for (std::size_t k = lag; k < left.size(); ++k) {
    const double change = left[k] - left[k - lag];
    if (std::isfinite(change)) sums[k * kParts / left.size()] += change * change;
  }
  return sums;
}

}  // namespace

int logger_shift(const LoopRecord& record, const plant::LoopModel& model) {
  if (!record.has_sp() || !record.has_co() || record.size() < kFewest) return 0;
  const control::PidSettings& pid = model.controller.pid;
  const double unshifted = left_by_law(record, pid, 0);
  int best = 0;
  double least = unshifted;
  for (int late = -kFurthest; late <= kFurthest; ++late) {
    const double left = left_by_law(record, pid, late);
    if (left < least) {
      least = left;
      best = late;
    }
  }
  if (best == 0 || least > kLaw || least > kClear * unshifted) return 0;
  const std::array<double, kParts> as_it_is = missed(record, model);
  const std::array<double, kParts> moved = missed(with_co_moved_back(record, best), model);
  std::size_t nearer = 0;
  for (std::size_t part = 0; part < kParts; ++part)
    nearer += static_cast<std::size_t>(moved[part] < as_it_is[part]);
  return nearer >= kAgreeing ? best : 0;
}

LoopRecord with_co_moved_back(LoopRecord record, int samples) {
  std::vector<double>& co = record.co;
  if (samples == 0 || co.empty()) return record;
  const auto by = std::min(static_cast<std::size_t>(std::abs(samples)), co.size() - 1);
  if (samples > 0) {
    const double last = co.back();
    std::rotate(co.begin(), co.begin() + static_cast<std::ptrdiff_t>(by), co.end());
    std::fill(co.end() - static_cast<std::ptrdiff_t>(by), co.end(), last);
  } else {
    const double first = co.front();
    std::rotate(co.rbegin(), co.rbegin() + static_cast<std::ptrdiff_t>(by), co.rend());
    std::fill(co.begin(), co.begin() + static_cast<std::ptrdiff_t>(by), first);
  }
  return record;
}

}  // namespace loopwarden::gap
