// SPDX-License-Identifier: Apache-2.0
#include "model/gap/confidence.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model/numeric/root_sum_square.hpp"
#include "model/gap/constants.hpp"

namespace loopwarden::gap {
namespace {

// F ratio of `innovations` on the moves of CO over the last 1, 2, 4, ... samples.
double answer_to_moves(const std::vector<double>& innovations, const std::vector<double>& co) {
  constexpr Eigen::Index kLags = 8;
  const auto n = static_cast<Eigen::Index>(std::min(innovations.size(), co.size()));
  if (n < 20 * kLags) return 0.0;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kLags, kLags);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kLags);
  double total = 0.0;
  Eigen::VectorXd row(kLags);
  const Eigen::Index first = Eigen::Index{1} << kLags;
  if (n < 2 * first) return 0.0;
  for (Eigen::Index k = first; k < n; ++k) {
    for (Eigen::Index i = 0; i < kLags; ++i) {
      const Eigen::Index near = Eigen::Index{1} << i;
      row(i) = co[static_cast<std::size_t>(k - near)] - co[static_cast<std::size_t>(k - 2 * near)];
    }
    const double e = innovations[static_cast<std::size_t>(k)];
    normal += row * row.transpose();
    right += e * row;
    total += e * e;
  }
  // Where CO does not move answers nothing, in any unit.
  Eigen::Index lags = 0;
  for (Eigen::Index i = 0; i < kLags; ++i) {
    if (normal(i, i) > 0.0) {
      normal(i, i) *= 1.0 + 1e-9;
      ++lags;
    } else {
      normal(i, i) = 1.0;
    }
  }
  if (lags == 0) return 0.0;
  const double explained = right.dot(normal.ldlt().solve(right));
  const auto freedom = static_cast<double>(n - first - lags);
  return (explained / static_cast<double>(lags)) / std::max((total - explained) / freedom, 1e-12);
}

// Laplace's rule: a row of few names promises little.
double share_right(const ConfidenceRow& row) noexcept {
  return (static_cast<double>(row.right) + 1.0) / (static_cast<double>(row.names) + 2.0);
}

}  // namespace

Residuals examine(const Fitter& fitter, const Hypothesis& hypothesis, double base_rmse,
                  const std::vector<double>& co, double record_noise, double period_s) {
  const Fit& fit = hypothesis.fit;
  Residuals left;
  left.noise_ratio = record_noise > 0.0 ? fit.noise_rms / record_noise : 1.0;
  const double ratio = fitter.load_ratio(fit);
  left.load_intensity = fit.noise_rms * ratio / std::sqrt(period_s);
  const double load_rms = left.load_intensity * std::sqrt(LoadFilter::kReturnTime_s / 2.0);
  const double valve_rms = fit.noise_rms * fitter.valve_ratio(fit);
  left.quiet_rmse = std::min(
      numeric::root_sum_square(numeric::root_sum_square(fit.noise_rms, load_rms), valve_rms),
      hypothesis.training_rmse);
  const std::vector<double> e = fitter.innovations(fit);
  double fourth = 0.0;
  double second = 0.0;
  for (const double v : e) {
    second += v * v;
    fourth += v * v * v * v;
  }
  const auto count = static_cast<double>(e.size());
  left.tail = (fourth / count) / std::max((second / count) * (second / count), 1e-12);
  left.answer = answer_to_moves(e, co);
  const double before = base_rmse * base_rmse - fit.noise_rms * fit.noise_rms;
  const double after =
      hypothesis.training_rmse * hypothesis.training_rmse - fit.noise_rms * fit.noise_rms;
  left.closed = before > 0.0 ? 1.0 - std::max(after, 0.0) / before : 1.0;
  left.adequate = is_noise(left.noise_ratio, left.tail, left.answer, fitter.load_at_limit(fit));
  left.believable = left.adequate || left.closed > kEnoughClosed;
  return left;
}

bool is_noise(double noise_ratio, double tail, double answer, bool load_at_limit) noexcept {
  return noise_ratio < kMostNoiseRatio && tail < kMostTail && answer < kMostAnswer &&
         !load_at_limit;
}

double confidence(double lead_nats, bool rest_is_noise, const ConfidenceTable& table) noexcept {
  const std::span<const ConfidenceRow> rows =
      rest_is_noise ? table.rest_is_noise : table.rest_is_more;
  const auto above = std::find_if(rows.begin() + 1, rows.end(), [&](const ConfidenceRow& row) {
    return row.from_nats > lead_nats;
  });
  return share_right(*(above - 1));
}

double controller_confidence(const ConfidenceTable& table) noexcept {
  return share_right(table.controller);
}

}  // namespace loopwarden::gap
