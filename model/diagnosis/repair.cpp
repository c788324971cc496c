// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/repair.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "model/numeric/enum_name.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

using estimator::BandGrid;

// Returns the nats by which a record excludes bands from `least` (CO units) on. Negative if it
// supports them; 0 if CO moved too far to show them, or if the record was not judged.
double excluded_by(const Diagnosis& d, double least) {
  const estimator::BandEvidence& band = d.band;
  if (!d.judged() || !(band.movement > 0.0)) return 0.0;
  // A band wider than the movement of CO acts like the widest of the grid: the stem rests.
  const double share = std::min(least / band.movement, BandGrid::kBands.back());
  if (share < BandGrid::kBands[BandGrid::kFirst]) return 0.0;
  double smaller = -std::numeric_limits<double>::infinity();
  double larger = smaller;
  for (std::size_t k = 0; k < BandGrid::kBands.size(); ++k) {
    double& best = BandGrid::kBands[k] < share ? smaller : larger;
    best = std::max(best, band.log_likelihood[k]);
  }
  return std::clamp(smaller - larger, BandGrid::kLeastNats, BandGrid::kMostNats);
}

double size_of(const Diagnosis& d) {
  return d.verdict == DiagnosisVerdict::valve_effect ? d.s : 0.0;
}

}  // namespace

const char* to_text(RepairResult result) noexcept {
  return numeric::enum_name<RepairResult::cant_tell>(result,
                                                     {"repaired", "not_repaired", "cant_tell"});
}

Repair judge_repair(std::span<const Diagnosis> before, std::span<const Diagnosis> after) {
  Repair repair;
  if (before.empty() || after.empty()) {
    repair.why = "no record before or after the work can be judged";
    return repair;
  }
  const LoopVerdict was = judge_loop(before);
  const LoopVerdict is = judge_loop(after);
  repair.before = before[was.like];
  repair.after = after[is.like];
  if (was.verdict != DiagnosisVerdict::valve_effect) {
    repair.why = "the record before the work shows no valve effect";
    return repair;
  }
  const double half = RepairLimits::kHalf * size_of(repair.before);
  for (const Diagnosis& d : after) repair.excluded_nats += excluded_by(d, half);
  if (is.verdict == DiagnosisVerdict::valve_effect) {
    const bool same = size_of(repair.after) >= half;
    repair.result = same ? RepairResult::not_repaired : RepairResult::cant_tell;
    repair.why = same ? "the valve still shows the effect" : "a smaller effect remains";
    return repair;
  }
  if (is.verdict == DiagnosisVerdict::not_enough_data) {
    repair.why = "the record after the work is too short, or CO moves too little in it";
    return repair;
  }
  const double needed = is.verdict == DiagnosisVerdict::cant_tell ? RepairLimits::kExcludedUndecided
                                                                  : RepairLimits::kExcluded;
  if (repair.excluded_nats < needed) {
    repair.why = "the record after the work agrees with a healthy valve and with the effect";
    return repair;
  }
  repair.result = RepairResult::repaired;
  repair.why = "the record after the work excludes half of the effect";
  return repair;
}

double unpredicted(std::span<const double> pv, std::span<const double> co) {
  constexpr Eigen::Index kOfPv = 3;
  constexpr Eigen::Index kOfCo = 6;
  constexpr std::size_t kMost = 20000;  // samples
  constexpr auto kFirst = static_cast<std::size_t>(kOfCo);
  const std::size_t n = std::min({pv.size(), co.size(), kMost});
  constexpr std::size_t kLeast = 100;
  if (n < kLeast) return std::nan("");
  const double level = numeric::mean(pv.first(n));
  const double output = numeric::mean(co.first(n));
  const auto rows = static_cast<Eigen::Index>(n - kFirst);
  Eigen::MatrixXd known(rows, kOfPv + kOfCo);
  Eigen::VectorXd next(rows);
  for (std::size_t k = kFirst; k < n; ++k) {
    const auto row = static_cast<Eigen::Index>(k - kFirst);
    next(row) = pv[k] - level;
    for (Eigen::Index i = 0; i < kOfPv; ++i)
      known(row, i) = pv[k - 1 - static_cast<std::size_t>(i)] - level;
    for (Eigen::Index i = 0; i < kOfCo; ++i)
      known(row, kOfPv + i) = co[k - 1 - static_cast<std::size_t>(i)] - output;
  }
  if (!known.allFinite() || !next.allFinite()) return std::nan("");
  const Eigen::VectorXd error = next - known * known.colPivHouseholderQr().solve(next);
  std::vector<double> sizes(error.data(), error.data() + error.size());
  for (double& size : sizes) size = std::abs(size);
  constexpr double kNormal = 1.4826;  // standard deviation over median of the sizes
  return kNormal * numeric::median(std::move(sizes));
}

}  // namespace loopwarden::diagnosis
