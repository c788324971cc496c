// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/prediction_error.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "model/analysis/limits.hpp"
#include "model/analysis/prediction_problem.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::analysis {
namespace {

// Returns atanh of the reflection coefficients of a polynomial; unstable coefficients are clamped.
Column reflections(Column p) {
  Column k(p.size() - 1);
  for (std::size_t m = p.size() - 1; m >= 1; --m) {
    const double last = std::clamp(p[m], -0.98, 0.98);
    k[m - 1] = std::atanh(last);
    Column lower(m);
    lower[0] = 1.0;
    for (std::size_t i = 1; i < m; ++i) lower[i] = (p[i] - last * p[m - i]) / (1.0 - last * last);
    p = std::move(lower);
  }
  return k;
}

const PredictionFit& better(const PredictionFit& a, const PredictionFit& b) {
  return b.sum_squares < a.sum_squares ? b : a;
}

struct GridPoint {
  double t = 1.0;
  std::size_t delay = 0;
  double left = kInfinity;
};

// Returns the grid point with the least sum of squares over dead times of whole periods, for one
// noise model.
GridPoint best_of_grid(const Samples& s, bool integrating, const NoiseModel& noise) {
  const Whitener whiten(noise, s.y);
  const std::size_t n = s.size();
  Column y = s.y;
  Column one(n, 1.0);
  whiten.run(y);
  whiten.run(one);
  Column slope(n);
  for (std::size_t k = 0; k < n; ++k) slope[k] = static_cast<double>(k) / static_cast<double>(n);
  whiten.run(slope);
  const auto view = [](const Column& c, std::size_t from, std::size_t count) {
    return Eigen::Map<const Eigen::VectorXd>(c.data() + from, static_cast<Eigen::Index>(count));
  };
  // The part of y that the level (and, if integrating, the slope) explains is subtracted.
  const double ones = std::max(view(one, 0, n).squaredNorm(), 1e-300);
  const auto take_off = [&](Column& c, const Column& other, double squares) {
    auto v = Eigen::Map<Eigen::VectorXd>(c.data(), static_cast<Eigen::Index>(n));
    const auto o = view(other, 0, n);
    v -= o * (o.dot(v) / squares);
  };
  take_off(slope, one, ones);
  const double slopes = std::max(view(slope, 0, n).squaredNorm(), 1e-300);
  take_off(y, one, ones);
  if (integrating) take_off(y, slope, slopes);
  const double all = view(y, 0, n).squaredNorm();
  GridPoint best;
  const auto most_delay =
      static_cast<std::size_t>(Limits::kLongestDeadTime * static_cast<double>(n));
  const double longest = integrating ? 0.7 * s.period_s : s.length_s() / 2.0;
  for (double t = 0.5 * s.period_s; t < longest; t *= 1.6) {
    Column g = unit_response(
        s.u, s.period_s,
        unit_process(integrating ? ProcessForm::integrating : ProcessForm::one_lag, t, 0.0, 0.0));
    // The shift below would move the gaps of y, so only y has e = 0 at missing samples in the sums
    // of the grid.
    const Whitener plain(noise, g);
    plain.run(g);
    Column squares{0.0};
    for (const double v : g) squares.push_back(squares.back() + v * v);
    for (std::size_t delay = 0; delay < most_delay; delay += std::max<std::size_t>(1, delay / 8)) {
      const std::size_t count = n - delay;
      const auto shifted = view(g, 0, count);
      const auto along = [&](const Column& c) { return shifted.dot(view(c, delay, count)); };
      double gg = squares[count] - std::pow(along(one), 2) / ones;
      if (integrating) gg -= std::pow(along(slope), 2) / slopes;
      if (!(gg > 1e-9 * squares[count])) continue;
      const double gy = along(y);
      const double left = all - gy * gy / gg;
      if (left < best.left) best = {t, delay, left};
    }
  }
  return best;
}

// Returns the best fit among the neighbours of the dead time at whole periods. If CO jumps at every
// sample, each period is a separate valley.
PredictionFit over_neighbours(const Samples& s, PredictionFit fit) {
  const Layout layout{fit.form, fit.noise.order()};
  const Problem problem(s, layout);
  for (int round = 0; round < 4; ++round) {
    const double before = fit.sum_squares;
    const PredictionFit around = fit;
    for (const double by : {-1.0, 1.0}) {
      Column x = layout.x_of(around);
      x[layout.dead()] += by * s.period_s;
      if (x[layout.dead()] < 0.0) continue;
      fit = better(fit, problem.solve(x, 4));
    }
    if (!(fit.sum_squares < (1.0 - 1e-6) * before)) break;
  }
  return fit;
}

}  // namespace

const char* to_text(ProcessForm form) noexcept {
  return numeric::enum_name<ProcessForm::integrating_lag>(
      form, {"one lag", "two lags", "integrating", "integrating with a lag"});
}

std::size_t PredictionFit::parameters() const noexcept {
  // K, y0, one x0 per start, and the variance of the noise.
  const std::size_t starts = is_integrating(form) ? 1 : form == ProcessForm::two_lags ? 3 : 2;
  return Layout{form, noise.order()}.size() + 3 + starts;
}

PredictionFit refined(const Samples& samples, const PredictionFit& from) {
  const Layout layout{from.form, from.noise.order()};
  const Problem problem(samples, layout);
  return over_neighbours(samples, problem.solve(layout.x_of(from), 60));
}

PredictionFit start_fit(const Samples& samples, bool integrating) {
  // White noise, a disturbance through a lag, a wandering disturbance plus white noise.
  struct Preset {
    double pole, zero;
  };
  constexpr std::array<Preset, 3> kPresets{{{0.0, 0.0}, {0.95, 0.0}, {0.998, 0.7}}};
  std::optional<PredictionFit> best;
  for (const Preset& preset : kPresets) {
    const NoiseModel noise{.d = {std::atanh(-preset.pole)}, .c = {std::atanh(-preset.zero)}};
    const GridPoint point = best_of_grid(samples, integrating, noise);
    PredictionFit start;
    start.form = integrating ? ProcessForm::integrating : ProcessForm::one_lag;
    start.time_constant_s = integrating ? 0.0 : point.t;
    // Half a period later than in the grid, away from the edge between two valleys.
    start.dead_time_s = (static_cast<double>(point.delay) + 0.5) * samples.period_s;
    start.noise = noise;
    if (preset.pole == 0.0) start.noise.d[0] = std::atanh(-0.3);
    const Layout layout{start.form, 1};
    const PredictionFit fit = Problem(samples, layout).solve(layout.x_of(start), 40);
    if (!best || fit.sum_squares < best->sum_squares) best = fit;
  }
  return over_neighbours(samples, *best);
}

PredictionFit with_noise_order(const Samples& samples, const PredictionFit& from,
                               std::size_t order) {
  PredictionFit start = from;
  start.noise = {};
  const Layout layout{from.form, order};
  if (order > 0) {
    // v and its innovations from the present model, then one regression of v on both.
    const Column e = innovations(samples, from);
    const Column run = free_run(samples, from);
    Column v(samples.size(), 0.0);
    for (std::size_t k = 0; k < v.size(); ++k) {
      if (!std::isnan(samples.y[k])) v[k] = samples.y[k] - run[k];
    }
    const auto width = static_cast<Eigen::Index>(2 * order);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(width, width);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(width);
    Eigen::VectorXd row(width);
    for (std::size_t k = order; k < v.size(); ++k) {
      for (std::size_t i = 0; i < order; ++i) {
        row(static_cast<Eigen::Index>(i)) = -v[k - 1 - i];
        row(static_cast<Eigen::Index>(order + i)) = e[k - 1 - i];
      }
      normal += row * row.transpose();
      right += row * v[k];
    }
    normal += 1e-10 * normal.trace() * Eigen::MatrixXd::Identity(width, width);
    const Eigen::VectorXd solved = normal.ldlt().solve(right);
    Column d{1.0};
    Column c{1.0};
    for (std::size_t i = 0; i < order; ++i) {
      d.push_back(solved(static_cast<Eigen::Index>(i)));
      c.push_back(solved(static_cast<Eigen::Index>(order + i)));
    }
    start.noise = {.d = reflections(d), .c = reflections(c)};
  }
  const Problem problem(samples, layout);
  PredictionFit best = problem.solve(layout.x_of(start), 60);
  if (order > from.noise.order()) {
    // A second start from the lower order, with small further coefficients.
    start.noise = from.noise;
    while (start.noise.d.size() < order) {
      start.noise.d.push_back(0.2);
      start.noise.c.push_back(-0.2);
    }
    best = better(best, problem.solve(layout.x_of(start), 60));
  }
  return best;
}

PredictionFit with_second_lag(const Samples& samples, const PredictionFit& from) {
  PredictionFit start = from;
  const bool integrating = is_integrating(from.form);
  start.form = integrating ? ProcessForm::integrating_lag : ProcessForm::two_lags;
  const Layout layout{start.form, from.noise.order()};
  const Problem problem(samples, layout);
  std::optional<PredictionFit> best;
  for (const double share : {0.05, 0.3, 0.7}) {
    const double whole =
        integrating ? std::max(from.dead_time_s, samples.period_s) : from.time_constant_s;
    start.second_lag_s = std::max(share * whole, 0.1 * samples.period_s);
    start.dead_time_s = std::max(0.0, from.dead_time_s - start.second_lag_s);
    const PredictionFit fit = problem.solve(layout.x_of(start), 40);
    if (!best || fit.sum_squares < best->sum_squares) best = fit;
  }
  return over_neighbours(samples, *best);
}

std::vector<double> innovations(const Samples& samples, const PredictionFit& fit) {
  const Layout layout{fit.form, fit.noise.order()};
  Eigen::VectorXd r;
  (void)Problem(samples, layout).residual(layout.x_of(fit), r);
  return {r.begin(), r.end()};
}

std::vector<double> free_run(const Samples& samples, const PredictionFit& fit) {
  const double t1 = std::max(fit.time_constant_s, 1e-300);
  Column run = unit_response(samples.u, samples.period_s,
                             unit_process(fit.form, is_integrating(fit.form) ? 1.0 : t1,
                                          fit.second_lag_s, fit.dead_time_s));
  const std::vector<Column> start =
      start_columns(samples, fit.form, t1, fit.second_lag_s, fit.dead_time_s);
  for (std::size_t k = 0; k < run.size(); ++k) {
    run[k] = fit.gain * run[k] + fit.level;
    for (std::size_t i = 0; i < start.size(); ++i) run[k] += fit.start[i] * start[i][k];
  }
  return run;
}

}  // namespace loopwarden::analysis
