// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/identification.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "model/numeric/least_squares.hpp"

namespace loopwarden::analysis {
namespace {

using Column = std::vector<double>;

constexpr std::size_t kFewestSamples = 10;
constexpr double kConfidence = 1.96;  // of a normal distribution, 95 %

struct Problem {
  Column u;  // CO less its first value
  Column y;  // PV, NaN where missing
  double period_s = 0.0;
  double latest_dead_time_s = 0.0;
  std::size_t used = 0;  // samples of y that are there
  double spread = 0.0;   // standard deviation of y
};

Problem problem_of(std::span<const double> co, std::span<const double> pv, double period_s) {
  if (co.size() != pv.size() || co.size() < kFewestSamples) {
    throw IdentificationError("a record of at least 10 samples with CO and PV is needed");
  }
  Problem p{.u = {}, .y = Column(pv.begin(), pv.end()), .period_s = period_s};
  double first = std::nan("");
  double held = std::nan("");
  std::size_t moved_at = co.size();
  for (std::size_t k = 0; k < co.size(); ++k) {
    if (std::isfinite(co[k])) held = co[k];
    if (!std::isfinite(first)) first = held;
    const double u = std::isfinite(held) ? held - first : 0.0;
    if (u != 0.0 && moved_at == co.size()) moved_at = k;
    p.u.push_back(u);
  }
  if (moved_at == co.size()) throw IdentificationError("CO never moves in this record");
  p.latest_dead_time_s = static_cast<double>(co.size() - moved_at) * period_s * 0.8;
  double sum = 0.0;
  double squares = 0.0;
  for (const double value : p.y) {
    if (!std::isfinite(value)) continue;
    ++p.used;
    sum += value;
    squares += value * value;
  }
  if (p.used < kFewestSamples) throw IdentificationError("PV is missing nearly everywhere");
  const auto n = static_cast<double>(p.used);
  p.spread = std::sqrt(std::max(0.0, squares / n - sum / n * sum / n));
  if (!(p.spread > 0.0)) throw IdentificationError("PV never moves in this record");
  return p;
}

// What a search moves: ln T1, ln T2 - ln T1 (second order), L.
struct Shape {
  double t1 = 1.0;
  double t2 = 0.0;
  double dead = 0.0;
};

Column unit_response(const Problem& p, const Shape& s) {
  const auto run = [&](double t) {
    plant::Process process({.gain = 1.0, .time_constant_s = t, .dead_time_s = s.dead}, p.period_s);
    process.reset(0.0);
    Column g{0.0};
    g.reserve(p.u.size());
    for (std::size_t k = 0; k + 1 < p.u.size(); ++k) g.push_back(process.step(p.u[k]));
    return g;
  };
  Column g = run(s.t1);
  if (s.t2 <= 0.0) return g;
  // Partial fractions; equal lags are kept apart by a thousandth.
  const double t2 = std::min(s.t2, 0.999 * s.t1);
  const Column fast = run(t2);
  for (std::size_t k = 0; k < g.size(); ++k) g[k] = (s.t1 * g[k] - t2 * fast[k]) / (s.t1 - t2);
  return g;
}

struct Linear {
  double y0 = 0.0;
  double gain = 0.0;
  double sum_squares = 0.0;
};

Linear solve_linear(const Problem& p, const Column& g) {
  double sg = 0.0, sy = 0.0, sgg = 0.0, sgy = 0.0, syy = 0.0;
  for (std::size_t k = 0; k < g.size(); ++k) {
    const double y = p.y[k];
    if (!std::isfinite(y)) continue;
    sg += g[k];
    sy += y;
    sgg += g[k] * g[k];
    sgy += g[k] * y;
    syy += y * y;
  }
  const auto n = static_cast<double>(p.used);
  const double variance = sgg - sg * sg / n;
  Linear l;
  if (variance > 1e-12 * (1.0 + sgg)) l.gain = (sgy - sg * sy / n) / variance;
  l.y0 = (sy - l.gain * sg) / n;
  l.sum_squares = std::max(0.0, syy - l.y0 * sy - l.gain * sgy);
  return l;
}

Shape coarse(const Problem& p, bool second) {
  const double length = static_cast<double>(p.u.size()) * p.period_s;
  Shape best;
  double least = -1.0;
  for (double t = std::max(p.period_s, length / 1000.0); t < length; t *= 1.5) {
    for (double share = 0.0; share < 1.0; share = share * 1.35 + 0.01) {
      const Shape s{t, second ? 0.3 * t : 0.0, share * p.latest_dead_time_s};
      const double sum = solve_linear(p, unit_response(p, s)).sum_squares;
      if (least >= 0.0 && sum >= least) continue;
      least = sum;
      best = s;
    }
  }
  return best;
}

// What the least squares move: y0, K, L, ln T1, and ln T2 with two lags.
Shape shape_of(const Column& v) {
  if (v.size() <= 4) return {std::exp(v[3]), 0.0, v[2]};
  return {std::exp(std::max(v[3], v[4])), std::exp(std::min(v[3], v[4])), v[2]};
}

numeric::Residual residual_of(const Problem& p) {
  return [&p](const Column& v, Eigen::VectorXd& r) {
    const Column g = unit_response(p, shape_of(v));
    r = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(g.size()));
    for (std::size_t k = 0; k < g.size(); ++k) {
      if (std::isfinite(p.y[k])) r[static_cast<Eigen::Index>(k)] = p.y[k] - v[0] - v[1] * g[k];
    }
  };
}

std::vector<numeric::Parameter> parameters_of(const Problem& p, const Linear& linear,
                                              const Shape& start) {
  const double length = static_cast<double>(p.u.size()) * p.period_s;
  const auto parameter = [](double value) {
    return numeric::Parameter{.value = value, .difference = 1e-7, .relative_difference = 1e-5};
  };
  const auto lag = [&](double time_s) {
    numeric::Parameter lag_log = parameter(std::log(time_s));
    lag_log.low = std::log(p.period_s / 100.0);
    lag_log.high = std::log(100.0 * length);
    return lag_log;
  };
  std::vector<numeric::Parameter> parameters{parameter(linear.y0), parameter(linear.gain),
                                             parameter(start.dead), lag(start.t1)};
  parameters[2].low = 0.0;
  parameters[2].high = p.latest_dead_time_s;
  if (start.t2 > 0.0) parameters.push_back(lag(start.t2));
  return parameters;
}

double neighbours_correlation(const Eigen::VectorXd& r) {
  const Eigen::Index n = r.size();
  const double all = r.squaredNorm();
  if (!(all > 0.0)) return 0.0;
  return std::clamp(r.head(n - 1).dot(r.tail(n - 1)) / all, 0.0, 0.98);
}

}  // namespace

ProcessFit identify(std::span<const double> co, std::span<const double> pv, double sample_time_s,
                    int order) {
  const Problem p = problem_of(co, pv, sample_time_s);
  const bool second = order == 2;
  const Shape start = coarse(p, second);
  const Linear linear = solve_linear(p, unit_response(p, start));
  if (linear.gain == 0.0) throw IdentificationError("PV does not answer to CO in this record");
  const std::vector<numeric::Parameter> parameters = parameters_of(p, linear, start);
  const numeric::Residual residual = residual_of(p);
  const numeric::LeastSquares found = numeric::least_squares(parameters, residual);
  const Column& v = found.x;
  const Eigen::VectorXd& r = found.residual;
  const Eigen::MatrixXd j = numeric::jacobian(parameters, residual, v, r);
  const auto n = static_cast<double>(p.used);
  const auto count = static_cast<double>(v.size());
  const double variance = r.squaredNorm() / std::max(1.0, n - count);
  const double rho = neighbours_correlation(r);
  const double inflation = (1.0 + rho) / (1.0 - rho);
  const Eigen::MatrixXd covariance =
      (j.transpose() * j).completeOrthogonalDecomposition().pseudoInverse() * variance * inflation;
  const auto margin = [&](Eigen::Index i) {
    return kConfidence * std::sqrt(std::max(0.0, covariance(i, i)));
  };
  ProcessFit fit;
  fit.order = second ? 2 : 1;
  fit.rest_pv = v[0];
  fit.gain = {v[1], margin(1)};
  fit.dead_time_s = {v[2], margin(2)};
  const Shape s = shape_of(v);
  const bool swapped = second && v[4] > v[3];
  fit.time_constant_s = {s.t1, s.t1 * margin(swapped ? 4 : 3)};
  if (second) fit.second_lag_s = {s.t2, s.t2 * margin(swapped ? 3 : 4)};
  fit.rmse = std::sqrt(r.squaredNorm() / n);
  fit.fit_percent = 100.0 * (1.0 - fit.rmse / p.spread);
  fit.criterion = n * std::log(std::max(fit.rmse * fit.rmse, 1e-300)) + count * std::log(n);
  return fit;
}

Tangent tangent_method(std::span<const double> co, std::span<const double> pv,
                       double sample_time_s) {
  const Problem p = problem_of(co, pv, sample_time_s);
  std::size_t at = 0;
  double largest = 0.0;
  double travel = 0.0;
  for (std::size_t k = 1; k < p.u.size(); ++k) {
    const double move = std::abs(p.u[k] - p.u[k - 1]);
    travel += move;
    if (move > largest) {
      largest = move;
      at = k;
    }
  }
  if (travel > 1.05 * largest) {
    throw IdentificationError("the tangent needs a record with one step of CO, and nothing else");
  }
  const auto mean = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t k = from; k < to; ++k) {
      if (!std::isfinite(p.y[k])) continue;
      sum += p.y[k];
      ++count;
    }
    if (count == 0) throw IdentificationError("PV is missing where the tangent needs it");
    return sum / static_cast<double>(count);
  };
  const std::size_t n = p.y.size();
  Tangent t;
  t.before = mean(0, at + 1);
  t.final_value = mean(n - std::max<std::size_t>(1, (n - at) / 10), n);
  const double rise = t.final_value - t.before;
  const auto reach = [&](double share) {
    for (std::size_t k = at; k < n; ++k) {
      if ((p.y[k] - t.before) / rise >= share) return k;
    }
    return n - 1;
  };
  const std::size_t slow = reach(0.85) - reach(0.2);
  const std::size_t width = std::max<std::size_t>(3, slow / 10);
  double steepest = 0.0;
  double touch = 0.0;
  double touch_value = 0.0;
  for (std::size_t k = at; k + width <= n; ++k) {
    const double middle = static_cast<double>(width - 1) / 2.0;
    double sum = 0.0, weighted = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < width; ++i) {
      const double x = static_cast<double>(i) - middle;
      sum += p.y[k + i];
      weighted += x * p.y[k + i];
      squares += x * x;
    }
    const double slope = weighted / squares;
    if (!(slope * rise > steepest * std::abs(rise))) continue;
    steepest = std::abs(slope);
    touch = static_cast<double>(k) + middle;
    touch_value = sum / static_cast<double>(width);
  }
  if (!(steepest > 0.0)) throw IdentificationError("PV does not answer to CO in this record");
  t.slope = std::copysign(steepest, rise) / sample_time_s;
  t.step_time_s = static_cast<double>(at) * sample_time_s;
  t.steepest_s = touch * sample_time_s;
  const double start_s = t.steepest_s - (touch_value - t.before) / t.slope;
  t.process = {.gain = rise / (p.u[at] - p.u[at - 1]),
               .time_constant_s = rise / t.slope,
               .dead_time_s = std::max(0.0, start_s - t.step_time_s)};
  return t;
}

}  // namespace loopwarden::analysis
