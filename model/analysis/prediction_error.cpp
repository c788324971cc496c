// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/prediction_error.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include "model/numeric/least_squares.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::analysis {
namespace {

using Column = std::vector<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kChiSquare95 = 3.841458820694124;  // one degree of freedom
constexpr double kMostReflection = 7.0;             // atanh: poles up to 1 - 1.7e-6
constexpr double kLongestDeadTime = 0.35;           // of the record
constexpr double kShortestLag = 0.05;               // of a period
constexpr double kLongestLag = 20.0;                // of the record
// Rounding, not noise: of the spread of y.
constexpr double kExact = 1e-9;

// 1 + p1 q^-1 + ... from reflection coefficients (Levinson).
Column polynomial(const Column& atanh_reflection) {
  Column p{1.0};
  for (const double raw : atanh_reflection) {
    const double k = std::tanh(raw);
    Column next = p;
    next.push_back(0.0);
    for (std::size_t i = 1; i < next.size(); ++i) next[i] += k * p[p.size() - i];
    p = std::move(next);
  }
  return p;
}

// The way back; what is unstable is pulled in.
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

// D/C over a column. Where y is missing e is 0, and v what the model foresaw.
class Whitener {
 public:
  Whitener(const NoiseModel& noise, const Column& y)
      : d_(polynomial(noise.d)), c_(polynomial(noise.c)), y_(y) {}

  void run(Column& v) const {
    switch (d_.size()) {
      case 1: return run_order<0>(v);
      case 2: return run_order<1>(v);
      case 3: return run_order<2>(v);
      default: return run_order<kMostNoiseOrder>(v);
    }
  }

 private:
  template <std::size_t Order>
  void run_order(Column& v) const {
    std::array<double, Order + 1> past_v{};
    std::array<double, Order + 1> past_e{};
    for (std::size_t k = 0; k < v.size(); ++k) {
      double foreseen = 0.0;
      for (std::size_t i = 0; i < Order; ++i) {
        foreseen += c_[i + 1] * past_e[i] - d_[i + 1] * past_v[i];
      }
      const bool missing = std::isnan(y_[k]);
      const double now = missing ? foreseen : v[k];
      const double e = missing ? 0.0 : now - foreseen;
      for (std::size_t i = Order; i-- > 1;) {
        past_v[i] = past_v[i - 1];
        past_e[i] = past_e[i - 1];
      }
      past_v[0] = now;
      past_e[0] = e;
      v[k] = e;
    }
  }

  Column d_, c_;
  const Column& y_;
};

plant::ProcessParameters unit_process(ProcessForm form, double t1, double t2, double dead) {
  return {.gain = 1.0,
          .time_constant_s = t1,
          .dead_time_s = dead,
          .second_time_constant_s = t2,
          .kind = is_integrating(form) ? plant::ProcessKind::integrating
                                       : plant::ProcessKind::self_regulating};
}

Column unit_response(const Column& u, double period_s, const plant::ProcessParameters& parameters) {
  plant::Process process(parameters, period_s);
  process.reset(0.0);
  Column g(u.size());
  for (std::size_t k = 0; k + 1 < u.size(); ++k) g[k + 1] = process.step(u[k]);
  return g;
}

Column start_column(const Samples& s, bool integrating, double t1) {
  Column column(s.size());
  double value = 1.0;
  const double keep = integrating ? 1.0 : std::exp(-s.period_s / t1);
  for (std::size_t k = 0; k < s.size(); ++k) {
    column[k] = integrating ? static_cast<double>(k) / static_cast<double>(s.size()) : value;
    value *= keep;
  }
  return column;
}

// The parameters of the search in a row: [ln T1] [ln T2] L, then the noise model.
struct Layout {
  ProcessForm form;
  std::size_t order;

  std::size_t lags() const {
    return form == ProcessForm::two_lags ? 2 : form == ProcessForm::integrating ? 0 : 1;
  }
  std::size_t dead() const { return lags(); }
  std::size_t noise() const { return lags() + 1; }
  std::size_t size() const { return noise() + 2 * order; }

  double t1(const Column& x) const { return is_integrating(form) ? 1.0 : std::exp(x[0]); }
  double t2(const Column& x) const {
    if (form == ProcessForm::integrating_lag) return std::exp(x[0]);
    return form == ProcessForm::two_lags ? std::exp(x[1]) : 0.0;
  }
  NoiseModel noise_of(const Column& x) const {
    const auto at = x.begin() + static_cast<std::ptrdiff_t>(noise());
    const auto middle = at + static_cast<std::ptrdiff_t>(order);
    return {.d = {at, middle}, .c = {middle, x.end()}};
  }
  Column x_of(const PredictionFit& fit) const {
    Column x;
    if (!is_integrating(form)) x.push_back(std::log(fit.time_constant_s));
    if (form == ProcessForm::two_lags || form == ProcessForm::integrating_lag) {
      x.push_back(std::log(fit.second_lag_s));
    }
    x.push_back(fit.dead_time_s);
    x.insert(x.end(), fit.noise.d.begin(), fit.noise.d.end());
    x.insert(x.end(), fit.noise.c.begin(), fit.noise.c.end());
    return x;
  }
};

struct Linear {
  double gain = 0.0;
  double level = 0.0;
  double start = 0.0;
};

class Problem {
 public:
  Problem(const Samples& samples, Layout layout, std::optional<double> fixed_gain = std::nullopt)
      : s_(samples), layout_(layout), fixed_gain_(fixed_gain) {}

  // e(x), with K, y0 and x0 solved for.
  Linear residual(const Column& x, Eigen::VectorXd& r) const {
    const auto noise_at = x.begin() + static_cast<std::ptrdiff_t>(layout_.noise());
    const Whitener whiten(layout_.noise_of(x), s_.y);
    if (!std::equal(x.begin(), noise_at, process_at_.begin(), process_at_.end())) {
      process_at_.assign(x.begin(), noise_at);
      const double t1 = layout_.t1(x);
      g_ = unit_response(s_.u, s_.period_s,
                         unit_process(layout_.form, t1, layout_.t2(x), x[layout_.dead()]));
      start_ = start_column(s_, is_integrating(layout_.form), t1);
    }
    if (level_.empty() || !std::equal(noise_at, x.end(), noise_at_.begin(), noise_at_.end())) {
      noise_at_.assign(noise_at, x.end());
      level_.assign(s_.size(), 1.0);
      y_ = s_.y;
      whiten.run(level_);
      whiten.run(y_);
    }
    Column g = g_;
    Column start = start_;
    whiten.run(g);
    whiten.run(start);
    const auto n = static_cast<Eigen::Index>(s_.size());
    Eigen::Map<const Eigen::VectorXd> yv(y_.data(), n);
    std::array<Eigen::Map<const Eigen::VectorXd>, 3> columns{
        Eigen::Map<const Eigen::VectorXd>(level_.data(), n),
        Eigen::Map<const Eigen::VectorXd>(start.data(), n),
        Eigen::Map<const Eigen::VectorXd>(g.data(), n)};
    r = yv;
    if (fixed_gain_) r -= *fixed_gain_ * columns[2];
    const int free = fixed_gain_ ? 2 : 3;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    Eigen::Vector3d scale = Eigen::Vector3d::Ones();
    for (int i = 0; i < free; ++i) {
      const double norm = columns[static_cast<std::size_t>(i)].norm();
      scale(i) = norm > 0.0 ? 1.0 / norm : 0.0;
    }
    for (int i = 0; i < free; ++i) {
      right(i) = scale(i) * columns[static_cast<std::size_t>(i)].dot(r);
      for (int j = 0; j < i; ++j) {
        normal(i, j) = normal(j, i) =
            scale(i) * scale(j) *
            columns[static_cast<std::size_t>(i)].dot(columns[static_cast<std::size_t>(j)]);
      }
      normal(i, i) = 1.0 + 1e-12;
    }
    const Eigen::Vector3d beta = normal.ldlt().solve(right).cwiseProduct(scale);
    for (int i = 0; i < free; ++i) r -= beta(i) * columns[static_cast<std::size_t>(i)];
    return {.gain = fixed_gain_.value_or(beta(2)), .level = beta(0), .start = beta(1)};
  }

  std::vector<numeric::Parameter> parameters(const Column& x) const {
    std::vector<numeric::Parameter> p;
    for (std::size_t i = 0; i < x.size(); ++i) {
      numeric::Parameter one{.value = x[i], .difference = 1e-5};
      if (i < layout_.lags()) {
        one.low = std::log(kShortestLag * s_.period_s);
        one.high = std::log(kLongestLag * s_.length_s());
        one.largest_move = 1.0;
      } else if (i == layout_.dead()) {
        one.low = 0.0;
        one.high = kLongestDeadTime * s_.length_s();
        one.difference = 1e-4 * s_.period_s;
      } else {
        one.low = -kMostReflection;
        one.high = kMostReflection;
        one.largest_move = 1.0;
      }
      p.push_back(one);
    }
    return p;
  }

  numeric::Residual function() const {
    return [this](const Column& x, Eigen::VectorXd& r) { (void)residual(x, r); };
  }

  PredictionFit fit_at(const Column& x) const {
    Eigen::VectorXd r;
    const Linear linear = residual(x, r);
    PredictionFit fit;
    fit.form = layout_.form;
    fit.gain = linear.gain;
    fit.level = linear.level;
    fit.start = linear.start;
    fit.time_constant_s = is_integrating(layout_.form) ? 0.0 : layout_.t1(x);
    fit.second_lag_s = layout_.t2(x);
    if (fit.second_lag_s > fit.time_constant_s && !is_integrating(layout_.form)) {
      std::swap(fit.second_lag_s, fit.time_constant_s);
    }
    fit.dead_time_s = x[layout_.dead()];
    fit.noise = layout_.noise_of(x);
    fit.sum_squares = r.squaredNorm();
    const auto n = static_cast<double>(s_.used);
    const double least = kExact * kExact * spread_squares();
    fit.criterion = n * std::log(std::max(fit.sum_squares, least) / n) +
                    static_cast<double>(fit.parameters()) * std::log(n);
    return fit;
  }

  // Parameter `held` stays where it is.
  PredictionFit solve(const Column& from, int most_steps,
                      std::optional<std::size_t> held = std::nullopt) const {
    std::vector<numeric::Parameter> p = parameters(from);
    if (held) p[*held].low = p[*held].high = from[*held];
    const numeric::LeastSquares found = numeric::least_squares(
        p, function(), {.most_steps = most_steps, .most_attempts = 8, .least_gain = 1e-7});
    return fit_at(found.x);
  }

 private:
  double spread_squares() const {
    double sum = 0.0;
    for (const double y : s_.y) sum += std::isnan(y) ? 0.0 : y * y;
    return sum;
  }

  const Samples& s_;
  Layout layout_;
  std::optional<double> fixed_gain_;
  // Of the last x: most differences move either the process or the noise model.
  mutable Column process_at_, noise_at_;
  mutable Column g_, start_;  // as they are
  mutable Column level_, y_;  // whitened
};

const PredictionFit& better(const PredictionFit& a, const PredictionFit& b) {
  return b.sum_squares < a.sum_squares ? b : a;
}

struct GridPoint {
  double t = 1.0;
  std::size_t delay = 0;
  double left = kInfinity;
};

// Least sum of squares over dead times of whole periods, for one noise model.
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
  // What the level explains (and, where integrating, the slope) is taken off y.
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
  const auto most_delay = static_cast<std::size_t>(kLongestDeadTime * static_cast<double>(n));
  const double longest = integrating ? 0.7 * s.period_s : s.length_s() / 2.0;
  for (double t = 0.5 * s.period_s; t < longest; t *= 1.6) {
    Column g = unit_response(
        s.u, s.period_s,
        unit_process(integrating ? ProcessForm::integrating : ProcessForm::one_lag, t, 0.0, 0.0));
    // Missing y: the shift below would move the gaps; they are left out of the grid's sums by e = 0 in y only.
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

// Whole-period neighbours of the dead time: with a CO that jumps at every sample each period is a valley of its
// own.
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
  // K, y0, x0, the noise's variance.
  return Layout{form, noise.order()}.size() + 4;
}

PredictionFit refined(const Samples& samples, const PredictionFit& from) {
  const Layout layout{from.form, from.noise.order()};
  const Problem problem(samples, layout);
  return over_neighbours(samples, problem.solve(layout.x_of(from), 60));
}

PredictionFit start_fit(const Samples& samples, bool integrating) {
  // White, a lagging load, a wandering load under white noise.
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
    // Half a period later than the grid's, away from the edge between two valleys.
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
    // v, its innovations by the model that there is, then one regression of v on both.
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
    // Also from the lower order itself, its further roots small.
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
  const Column start = start_column(samples, is_integrating(fit.form), t1);
  for (std::size_t k = 0; k < run.size(); ++k) {
    run[k] = fit.gain * run[k] + fit.level + fit.start * start[k];
  }
  return run;
}

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
  columns.push_back(start_column(samples, integrating, t1));
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd j(n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    whiten.run(columns[i]);
    j.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::VectorXd>(columns[i].data(), n);
  }
  // The gain's own part: what of its column the others don't explain.
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

// How far the sum of squares rises where one quantity is held, and the fit there.
using HeldFit = std::function<PredictionFit(double value, const PredictionFit& from)>;

double end_of(const HeldFit& fit_with, PredictionFit& best, double value, double step, double low,
              double high, double variance) {
  // The root of the rise is nearly linear in the distance: regula falsi on it.
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
    // First steps from the curvature.
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
      const double shortest = std::log(kShortestLag * samples.period_s);
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
