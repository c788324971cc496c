// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/error_filter.hpp"

#include <algorithm>
#include <cmath>

#include "model/estimator/constants.hpp"

namespace loopwarden::estimator {

ErrorFilter::ErrorFilter(const Blocks& blocks, ErrorTimes times, double disturbance,
                         std::span<const double> law_variance)
    : keep_disturbance_(std::exp(-blocks.period_s() / times.returns_s)),
      keep_law_(std::exp(-blocks.period_s() / times.answer_s)),
      gains_(blocks.count(), Gain{0.0, 0.0, 0.0}) {
  const double drift = disturbance * disturbance * blocks.period_s();
  const double new_law = 1.0 - keep_law_ * keep_law_;
  double dd = 0.0;
  double dm = 0.0;
  double mm = law_variance[0];
  double product = 1.0;
  for (std::size_t k = 0; k < gains_.size(); ++k) {
    if (blocks.variance()[k] > 0.0) {
      const double d = dd + dm;
      const double m = dm + mm;
      const double variance = d + m + blocks.variance()[k];
      const double inverse = 1.0 / variance;
      gains_[k] = {keep_disturbance_ * d * inverse, keep_law_ * m * inverse, std::sqrt(inverse)};
      product *= variance;
      if (product < 1e-250 || product > 1e250) {
        log_determinant_ += std::log(product);
        product = 1.0;
      }
      dd -= d * d * inverse;
      dm -= d * m * inverse;
      mm -= m * m * inverse;
    }
    dd = keep_disturbance_ * keep_disturbance_ * dd + drift;
    dm *= keep_disturbance_ * keep_law_;
    mm = keep_law_ * keep_law_ * mm + new_law * law_variance[std::min(k + 1, gains_.size() - 1)];
  }
  log_determinant_ += std::log(product);
}

void ErrorFilter::whiten(std::span<const double> in, std::span<double> out) const noexcept {
  double d = 0.0;
  double m = 0.0;
  for (std::size_t k = 0; k < gains_.size(); ++k) {
    const Gain& gain = gains_[k];
    const double e = in[k] - d - m;
    out[k] = e * gain.scale;
    d = keep_disturbance_ * d + gain.disturbance * e;
    m = keep_law_ * m + gain.law * e;
  }
}

void ErrorFilter::whiten_four(const double* const in[4], double* const out[4]) const noexcept {
  double d[4] = {};
  double m[4] = {};
  for (std::size_t k = 0; k < gains_.size(); ++k) {
    const Gain gain = gains_[k];
    for (std::size_t i = 0; i < 4; ++i) {
      const double e = in[i][k] - d[i] - m[i];
      out[i][k] = e * gain.scale;
      d[i] = keep_disturbance_ * d[i] + gain.disturbance * e;
      m[i] = keep_law_ * m[i] + gain.law * e;
    }
  }
}

Eigen::VectorXd ErrorFilter::log_scales() const {
  Eigen::VectorXd logs(static_cast<Eigen::Index>(gains_.size()));
  for (std::size_t k = 0; k < gains_.size(); ++k) {
    const double scale = gains_[k].scale;
    logs(static_cast<Eigen::Index>(k)) = scale > 0.0 ? -std::log(scale) : 0.0;
  }
  return logs;
}

std::vector<double> activity(const Blocks& blocks, std::span<const double> co, double dead_time_s,
                             double answer_s) {
  const double h = blocks.sample_time_s();
  const double follows = 1.0 - std::exp(-h / answer_s);
  const auto delay = static_cast<std::size_t>(dead_time_s / h + 1e-6);
  std::vector<double> moves(blocks.count(), 0.0);
  double lagged = co[0];
  double mean = 0.0;
  for (std::size_t k = 0; k < blocks.samples(); ++k) {
    const double late = co[k > delay ? k - delay : 0];
    moves[k / blocks.per_block()] += (late - lagged) * (late - lagged);
    mean += (late - lagged) * (late - lagged) / static_cast<double>(blocks.count());
    lagged += follows * (late - lagged);
  }
  for (double& v : moves) {
    const double share = mean > 0.0 ? v / mean : 1.0;
    v = kLimits.law_at_rest + (1.0 - kLimits.law_at_rest) * std::min(10.0, share);
  }
  return moves;
}

ErrorGrid::ErrorGrid(const Blocks& blocks, ErrorTimes times, double pv_span,
                     double largest_disturbance, std::vector<double> activity)
    : blocks_(blocks), times_(times), activity_(std::move(activity)) {
  for (const double share : kLimits.disturbances) {
    disturbance_.push_back(share * largest_disturbance);
  }
  for (const double share : kLimits.law_errors) law_.push_back(share * pv_span);
  std::vector<double> variance(blocks.count());
  for (const double q : disturbance_) {
    for (const double c : law_) {
      for (std::size_t k = 0; k < variance.size(); ++k) variance[k] = c * c * activity_[k];
      filters_.emplace_back(blocks, times, q, variance);
    }
  }
}

ErrorFilter ErrorGrid::with_jumps(std::size_t index, std::span<const double> more) const {
  const ErrorSize size = size_at(index);
  std::vector<double> variance(blocks_.count());
  for (std::size_t k = 0; k < variance.size(); ++k) {
    variance[k] = size.law * size.law * activity_[k] + more[k];
  }
  return {blocks_, times_, size.disturbance, variance};
}

}  // namespace loopwarden::estimator
