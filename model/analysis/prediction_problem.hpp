// SPDX-License-Identifier: Apache-2.0
// The least-squares problem of prediction_error.hpp, shared by its sources.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "model/analysis/limits.hpp"
#include "model/analysis/prediction_error.hpp"
#include "model/numeric/least_squares.hpp"

namespace loopwarden::analysis {

using Column = std::vector<double>;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kMostReflection = 7.0;  // atanh: poles up to 1 - 1.7e-6
inline constexpr double kExact = 1e-9;          // share of the spread of y: rounding, not noise

// Returns 1 + p1 q^-1 + ... from reflection coefficients (Levinson).
inline Column polynomial(const Column& atanh_reflection) {
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

// Filters a column with D/C. At a missing y, e is 0 and v is the prediction of the model.
class Whitener {
 public:
  Whitener(const NoiseModel& noise, const Column& y)
      : d_(polynomial(noise.d)), c_(polynomial(noise.c)), y_(y) {}

  void run(Column& v) const {
    switch (d_.size()) {
      case 1: return run_order<0>(v);
      case 2: return run_order<1>(v);
      case 3: return run_order<2>(v);
      default: return run_order<Limits::kMostNoiseOrder>(v);
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

inline plant::ProcessParameters unit_process(ProcessForm form, double t1, double t2, double dead) {
  return {.gain = 1.0,
          .time_constant_s = t1,
          .dead_time_s = dead,
          .second_time_constant_s = t2,
          .kind = is_integrating(form) ? plant::ProcessKind::integrating
                                       : plant::ProcessKind::self_regulating};
}

inline Column unit_response(const Column& u, double period_s,
                            const plant::ProcessParameters& parameters) {
  plant::Process process(parameters, period_s);
  process.reset(0.0);
  Column g(u.size());
  for (std::size_t k = 0; k + 1 < u.size(); ++k) g[k + 1] = process.step(u[k]);
  return g;
}

inline Column decay(std::size_t samples, double period_s, double time_constant_s) {
  Column column(samples);
  const double keep = std::exp(-period_s / time_constant_s);
  double value = 1.0;
  for (double& v : column) {
    v = value;
    value *= keep;
  }
  return column;
}

// Returns the columns of a start away from rest: the decay of each lag, and the effect of another
// CO before the first sample through the dead time and the lags. If integrating, the column is a
// slope.
inline std::vector<Column> start_columns(const Samples& s, ProcessForm form, double t1, double t2,
                                         double dead) {
  if (is_integrating(form)) {
    Column slope(s.size());
    for (std::size_t k = 0; k < s.size(); ++k) {
      slope[k] = static_cast<double>(k) / static_cast<double>(s.size());
    }
    return {std::move(slope)};
  }
  Column before =
      unit_response(Column(s.size(), 1.0), s.period_s, unit_process(form, t1, t2, dead));
  for (double& v : before) v = 1.0 - v;
  std::vector<Column> columns{decay(s.size(), s.period_s, t1), std::move(before)};
  if (form == ProcessForm::two_lags) columns.push_back(decay(s.size(), s.period_s, t2));
  return columns;
}

// The order of the search parameters: [ln T1] [ln T2] L, then the noise model.
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
  std::array<double, kMostStarts> start{};
};

class Problem {
 public:
  Problem(const Samples& samples, Layout layout, std::optional<double> fixed_gain = std::nullopt)
      : s_(samples), layout_(layout), fixed_gain_(fixed_gain) {}

  // Fills `r` with e(x) and returns the solved K, y0 and x0.
  Linear residual(const Column& x, Eigen::VectorXd& r) const {
    const auto noise_at = x.begin() + static_cast<std::ptrdiff_t>(layout_.noise());
    const Whitener whiten(layout_.noise_of(x), s_.y);
    if (!std::equal(x.begin(), noise_at, process_at_.begin(), process_at_.end())) {
      process_at_.assign(x.begin(), noise_at);
      const double t1 = layout_.t1(x);
      g_ = unit_response(s_.u, s_.period_s,
                         unit_process(layout_.form, t1, layout_.t2(x), x[layout_.dead()]));
      start_ = start_columns(s_, layout_.form, t1, layout_.t2(x), x[layout_.dead()]);
    }
    if (level_.empty() || !std::equal(noise_at, x.end(), noise_at_.begin(), noise_at_.end())) {
      noise_at_.assign(noise_at, x.end());
      level_.assign(s_.size(), 1.0);
      y_ = s_.y;
      whiten.run(level_);
      whiten.run(y_);
    }
    Column g = g_;
    std::vector<Column> start = start_;
    whiten.run(g);
    for (Column& column : start) whiten.run(column);
    const auto n = static_cast<Eigen::Index>(s_.size());
    using View = Eigen::Map<const Eigen::VectorXd>;
    View yv(y_.data(), n);
    // The column of the gain is the last one.
    std::vector<View> columns{View(level_.data(), n)};
    for (const Column& column : start) columns.emplace_back(column.data(), n);
    columns.emplace_back(g.data(), n);
    r = yv;
    if (fixed_gain_) r -= *fixed_gain_ * columns.back();
    const int free = static_cast<int>(columns.size()) - (fixed_gain_ ? 1 : 0);
    constexpr int kMost = 2 + static_cast<int>(kMostStarts);
    using Square =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMost, kMost>;
    using Small = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMost, 1>;
    Square normal = Square::Identity(free, free);
    Small right = Small::Zero(free);
    Small scale = Small::Ones(free);
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
    const Small beta = normal.ldlt().solve(right).cwiseProduct(scale);
    for (int i = 0; i < free; ++i) r -= beta(i) * columns[static_cast<std::size_t>(i)];
    Linear linear{.gain = fixed_gain_ ? *fixed_gain_ : beta(free - 1), .level = beta(0)};
    for (std::size_t i = 0; i < start.size(); ++i) {
      linear.start[i] = beta(static_cast<Eigen::Index>(i) + 1);
    }
    return linear;
  }

  std::vector<numeric::Parameter> parameters(const Column& x) const {
    std::vector<numeric::Parameter> p;
    for (std::size_t i = 0; i < x.size(); ++i) {
      numeric::Parameter one{.value = x[i], .difference = 1e-5};
      if (i < layout_.lags()) {
        one.low = std::log(Limits::kShortestLag * s_.period_s);
        one.high = std::log(Limits::kLongestLag * s_.length_s());
        one.largest_move = 1.0;
      } else if (i == layout_.dead()) {
        one.low = 0.0;
        one.high = Limits::kLongestDeadTime * s_.length_s();
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
      std::swap(fit.start.front(), fit.start.back());
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

  // Returns the fit after least squares from `from`; the parameter `held` keeps its value.
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
  // Results for the last x, kept because most differences move either the process or the noise
  // model.
  mutable Column process_at_, noise_at_;
  mutable Column g_;  // not whitened
  mutable std::vector<Column> start_;
  mutable Column level_, y_;  // whitened
};

}  // namespace loopwarden::analysis
