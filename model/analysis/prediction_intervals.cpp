// SPDX-License-Identifier: Apache-2.0
// The intervals of prediction_error.hpp.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

#include "model/analysis/limits.hpp"

#include "model/analysis/prediction_problem.hpp"

namespace loopwarden::analysis {

double gain_error_under(const Samples& samples, const PredictionFit& fit,
                        const std::vector<double>& u) {
  const bool integrating = is_integrating(fit.form);
  const double t1 = integrating ? 1.0 : fit.time_constant_s;
  const Whitener whiten(fit.noise, samples.y);
  const auto response = [&](double t, double t2, double dead) {
    return unit_response(u, samples.period_s, unit_process(fit.form, t, t2, dead));
  };
  std::vector<Column> columns{response(t1, fit.second_lag_s, fit.dead_time_s)};
  const auto slope = [&](const Column& there, double by) {
    Column column(there.size());
    for (std::size_t k = 0; k < there.size(); ++k) column[k] = (there[k] - columns[0][k]) / by;
    columns.push_back(std::move(column));
  };
  constexpr double kStep = 1e-3;
  if (!integrating) slope(response(t1 * (1.0 + kStep), fit.second_lag_s, fit.dead_time_s), kStep);
  if (fit.second_lag_s > 0.0) {
    slope(response(t1, fit.second_lag_s * (1.0 + kStep), fit.dead_time_s), kStep);
  }
  const double by_s = 0.5 * samples.period_s;
  slope(response(t1, fit.second_lag_s, fit.dead_time_s + by_s), by_s);
  columns.emplace_back(samples.size(), 1.0);
  for (Column& start : start_columns(samples, fit.form, t1, fit.second_lag_s, fit.dead_time_s)) {
    columns.push_back(std::move(start));
  }
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd j(n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    whiten.run(columns[i]);
    j.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::VectorXd>(columns[i].data(), n);
  }
  // The part of the gain's column that the other columns don't explain.
  const Eigen::VectorXd gain = j.col(0);
  const Eigen::MatrixXd others = j.rightCols(j.cols() - 1);
  const Eigen::VectorXd explained = others.completeOrthogonalDecomposition().solve(gain);
  const double own = (gain - others * explained).squaredNorm();
  const double variance =
      fit.sum_squares /
      std::max(1.0, static_cast<double>(samples.used) - static_cast<double>(fit.parameters()));
  return own > 0.0 ? std::sqrt(variance / own) : kInfinity;
}

namespace {

constexpr double kChiSquare95 = 3.841458820694124;  // one degree of freedom

// Returns the best fit with one quantity held at `value`, started from `from`.
using HeldFit = std::function<PredictionFit(double value, const PredictionFit& from)>;

double end_of(const HeldFit& fit_with, PredictionFit& best, double value, double step, double low,
              double high, double variance) {
  // The square root of the rise is nearly linear in the distance, which suits regula falsi.
  PredictionFit last = best;
  double near = value;
  double near_root = 0.0;
  double far = std::clamp(value + step, low, high);
  const double wanted = std::sqrt(kChiSquare95);
  for (int round = 0; round < 14; ++round) {
    last = fit_with(far, last);
    const double rise = (last.sum_squares - best.sum_squares) / variance;
    if (rise < -1e-3) best = last;
    const double root = std::sqrt(std::max(0.0, rise));
    if (std::abs(root - wanted) < 0.03) return far;
    if (root < wanted && (far <= low || far >= high)) return far <= low ? low : high;
    const double grow = root > near_root ? (wanted - near_root) / (root - near_root) : 4.0;
    const double next = near + (far - near) * std::clamp(grow, 0.1, 4.0);
    if (root < wanted) {
      near = far;
      near_root = root;
    }
    far = std::clamp(next, low, high);
  }
  return far;
}

}  // namespace

Intervals curvature_intervals(const Samples& samples, const PredictionFit& fit) {
  const Layout layout{fit.form, fit.noise.order()};
  const Problem problem(samples, layout);
  const Column x = layout.x_of(fit);
  Eigen::VectorXd r;
  (void)problem.residual(x, r);
  const Eigen::MatrixXd j = numeric::jacobian(problem.parameters(x), problem.function(), x, r);
  const double variance =
      fit.sum_squares /
      std::max(1.0, static_cast<double>(samples.used) - static_cast<double>(fit.parameters()));
  const Eigen::MatrixXd covariance =
      (j.transpose() * j).completeOrthogonalDecomposition().pseudoInverse() * variance;
  const auto margin = [&](std::size_t i) {
    const auto at = static_cast<Eigen::Index>(i);
    return std::sqrt(kChiSquare95 * std::max(0.0, covariance(at, at)));
  };
  const auto around = [](double value, double by) {
    return Estimate{.value = value, .low = value - by, .high = value + by};
  };
  const auto lag = [&](std::size_t i) {
    const double factor = std::exp(margin(i));
    const double value = std::exp(x[i]);
    return Estimate{.value = value, .low = value / factor, .high = value * factor};
  };
  Intervals out;
  if (!is_integrating(fit.form)) out.time_constant_s = lag(0);
  if (fit.form == ProcessForm::two_lags) out.second_lag_s = lag(1);
  if (fit.form == ProcessForm::integrating_lag) out.second_lag_s = lag(0);
  out.dead_time_s = around(fit.dead_time_s, margin(layout.dead()));
  out.dead_time_s.low = std::max(0.0, out.dead_time_s.low);
  out.gain = around(fit.gain, std::sqrt(kChiSquare95) * gain_error_under(samples, fit, samples.u));
  return out;
}

Intervals profile_intervals(const Samples& samples, PredictionFit& fit) {
  const Layout layout{fit.form, fit.noise.order()};
  const Problem problem(samples, layout);
  Intervals out;
  for (int round = 0; round < 2; ++round) {
    const double before = fit.sum_squares;
    const Column x = layout.x_of(fit);
    const double freedom =
        std::max(1.0, static_cast<double>(samples.used) - static_cast<double>(fit.parameters()));
    const double variance = std::max(fit.sum_squares / freedom, 1e-300);
    // The first steps follow from the curvature.
    Eigen::VectorXd r;
    (void)problem.residual(x, r);
    const Eigen::MatrixXd j = numeric::jacobian(problem.parameters(x), problem.function(), x, r);
    const Eigen::MatrixXd covariance =
        (j.transpose() * j).completeOrthogonalDecomposition().pseudoInverse() * variance;
    const auto first_step = [&](std::size_t i, double most) {
      const auto at = static_cast<Eigen::Index>(i);
      const double step = 1.96 * std::sqrt(std::max(0.0, covariance(at, at)));
      return std::clamp(step, 1e-6 * most, most);
    };
    const auto ends = [&](const HeldFit& held, double value, double step, double low, double high) {
      return Estimate{.value = value,
                      .low = end_of(held, fit, value, -step, low, high, variance),
                      .high = end_of(held, fit, value, step, low, high, variance)};
    };
    const auto of_parameter = [&](std::size_t i, double most) {
      const numeric::Parameter p = problem.parameters(x)[i];
      const HeldFit held = [&, i](double value, const PredictionFit& from) {
        Column start = layout.x_of(from);
        start[i] = value;
        return problem.solve(start, 8, i);
      };
      Estimate e = ends(held, x[i], first_step(i, most), p.low, p.high);
      if (e.high >= p.high) e.high = kInfinity;
      return e;
    };
    const auto of_lag = [&](std::size_t i) {
      const Estimate e = of_parameter(i, 0.7);
      const double shortest = std::log(Limits::kShortestLag * samples.period_s);
      return Estimate{.value = std::exp(e.value),
                      .low = e.low <= shortest ? 0.0 : std::exp(e.low),
                      .high = std::exp(e.high)};
    };
    if (!is_integrating(fit.form)) out.time_constant_s = of_lag(0);
    if (fit.form == ProcessForm::two_lags) out.second_lag_s = of_lag(1);
    if (fit.form == ProcessForm::integrating_lag) out.second_lag_s = of_lag(0);
    out.dead_time_s = of_parameter(layout.dead(), 0.3 * samples.length_s());
    const HeldFit held = [&](double value, const PredictionFit& from) {
      return Problem(samples, layout, value).solve(layout.x_of(from), 8);
    };
    const double error = gain_error_under(samples, fit, samples.u);
    const double step = std::clamp(1.96 * error, 1e-6 * std::abs(fit.gain), std::abs(fit.gain));
    out.gain = ends(held, fit.gain, step, -kInfinity, kInfinity);
    if (!(fit.sum_squares < (1.0 - 1e-6) * before)) break;
    fit = refined(samples, fit);
  }
  return out;
}

}  // namespace loopwarden::analysis
