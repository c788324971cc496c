// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/least_squares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace loopwarden::numeric {
namespace {

Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

}  // namespace

Eigen::VectorXd damped_move(const std::vector<Parameter>& parameters, const std::vector<double>& x,
                            const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient,
                            double damping) {
  Eigen::MatrixXd damped = normal;
  Eigen::VectorXd right = -gradient;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Eigen::Index at = index(i);
    const bool blocked = (x[i] <= parameters[i].low && gradient(at) > 0.0) ||
                         (x[i] >= parameters[i].high && gradient(at) < 0.0);
    if (blocked || !(normal(at, at) > 0.0)) {
      damped.row(at).setZero();
      damped.col(at).setZero();
      damped(at, at) = 1.0;
      right(at) = 0.0;
    } else {
      damped(at, at) *= 1.0 + damping;
    }
  }
  return damped.ldlt().solve(right);
}

std::vector<double> moved(const std::vector<Parameter>& parameters, const std::vector<double>& x,
                          const Eigen::VectorXd& move) {
  std::vector<double> to = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Parameter& p = parameters[i];
    const double by = std::clamp(move(index(i)), -p.largest_move, p.largest_move);
    to[i] = std::clamp(x[i] + by, p.low, p.high);
  }
  return to;
}

Eigen::MatrixXd jacobian(const std::vector<Parameter>& parameters, const Residual& residual,
                         const std::vector<double>& x, const Eigen::VectorXd& r) {
  Eigen::MatrixXd slopes(r.size(), index(x.size()));
  Eigen::VectorXd there(r.size());
  std::vector<double> at = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Parameter& p = parameters[i];
    const double step = std::max(p.difference, p.relative_difference * std::abs(x[i]));
    const double by = x[i] + step <= p.high ? step : -step;
    at[i] = x[i] + by;
    residual(at, there);
    slopes.col(index(i)) = (there - r) / by;
    at[i] = x[i];
  }
  return slopes;
}

LeastSquares least_squares(const std::vector<Parameter>& parameters, const Residual& residual,
                           const LeastSquaresSettings& settings) {
  LeastSquares best;
  for (const Parameter& p : parameters) best.x.push_back(std::clamp(p.value, p.low, p.high));
  residual(best.x, best.residual);
  best.sum_squares = best.residual.squaredNorm();
  double damping = settings.first_damping;
  Eigen::VectorXd there;
  for (int step = 0; step < settings.most_steps && std::isfinite(best.sum_squares); ++step) {
    const Eigen::MatrixXd slopes = jacobian(parameters, residual, best.x, best.residual);
    const Eigen::MatrixXd normal = slopes.transpose() * slopes;
    const Eigen::VectorXd gradient = slopes.transpose() * best.residual;
    bool helped = false;
    for (int attempt = 0; attempt < settings.most_attempts && !helped; ++attempt) {
      std::vector<double> to =
          moved(parameters, best.x, damped_move(parameters, best.x, normal, gradient, damping));
      double sum = std::numeric_limits<double>::infinity();
      if (std::all_of(to.begin(), to.end(), [](double v) { return std::isfinite(v); })) {
        residual(to, there);
        sum = there.squaredNorm();
      }
      if (!(sum < best.sum_squares)) {
        damping *= settings.tightening;
        continue;
      }
      const double gain = best.sum_squares - sum;
      helped = gain > settings.least_gain * best.sum_squares;
      best.x = std::move(to);
      best.residual.swap(there);
      best.sum_squares = sum;
      damping = std::max(damping * settings.easing, settings.least_damping);
      if (!helped) return best;
    }
    if (!helped) break;
  }
  return best;
}

}  // namespace loopwarden::numeric
