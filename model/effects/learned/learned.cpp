// SPDX-License-Identifier: Apache-2.0
#include "model/effects/learned/learned.hpp"

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

namespace loopwarden::effects {
namespace {

std::size_t order_of(const LearnedFilter::Coefficients& denominator) {
  std::size_t order = LearnedFilter::kMostOrder;
  while (order > 0 && denominator[order] == 0.0) --order;
  return order;
}

// Returns the controllable canonical form: x_i' = x_(i+1), and the last row from the denominator.
Eigen::MatrixXd companion(const LearnedFilter::Coefficients& denominator, std::size_t order) {
  const auto n = static_cast<Eigen::Index>(order);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) a(i, i + 1) = 1.0;
  for (std::size_t i = 0; i < order; ++i) {
    a(n - 1, static_cast<Eigen::Index>(i)) = -denominator[i] / denominator[order];
  }
  return a;
}

}  // namespace

double interpolate(const Points& points, double x) noexcept {
  const auto above = std::upper_bound(points.begin(), points.end(), x,
                                      [](double v, const auto& p) { return v < p.first; });
  if (above == points.begin()) return points.front().second;
  if (above == points.end()) return points.back().second;
  const auto& [x0, y0] = *(above - 1);
  return y0 + (above->second - y0) * (x - x0) / (above->first - x0);
}

LearnedFilter::LearnedFilter(const Coefficients& numerator, const Coefficients& denominator,
                             double period_s)
    : order_(order_of(denominator)) {
  const double leading = denominator[order_];
  through_ = numerator[order_] / leading;
  if (order_ == 0) return;
  const auto n = static_cast<Eigen::Index>(order_);
  // The exponential of [A B; 0 0] over one sample has both the transition matrix and the input
  // vector.
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(n + 1, n + 1);
  both.topLeftCorner(n, n) = companion(denominator, order_);
  both(n - 1, n) = 1.0 / leading;
  const Eigen::MatrixXd over_sample = (both * period_s).exp();
  for (std::size_t i = 0; i < order_; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t j = 0; j < order_; ++j) {
      keep_[i][j] = over_sample(row, static_cast<Eigen::Index>(j));
    }
    input_[i] = over_sample(row, n);
    weights_[i] = numerator[i] - through_ * denominator[i];
  }
  at_rest_ = 1.0 / denominator[0];
}

double LearnedFilter::reset(double u) noexcept {
  state_ = {};
  state_[0] = at_rest_ * u;
  return output(u);
}

std::string check_poles(const LearnedFilter::Coefficients& denominator) {
  const std::size_t order = order_of(denominator);
  if (order == 0) return "denominator must be of order 1 to 3";
  const Eigen::VectorXcd poles = companion(denominator, order).eigenvalues();
  for (const std::complex<double>& pole : poles) {
    if (!(pole.real() <= -1e-6)) return "denominator has a pole that does not die away";
  }
  return {};
}

}  // namespace loopwarden::effects
