// SPDX-License-Identifier: Apache-2.0
// A behaviour that a record shows and that no named effect describes (effect `learned`). It has
// four forms:
//
//   static        y = u + d(u)
//   hysteretic    y = offset + sum of w_j P_j(u),  P_j a play of half width r_j
//                 (Prandtl-Ishlinskii)
//   dynamic       y = G(p) u,  G = (b0 + b1 p + ...) / (a0 + a1 p + ...), order 1 to 3, u held
//                 over a sample
//   gain_profile  y = g u,  g by the time of the record or by u
//
//   u, y    CO units, at the valve's flow or at the input of the process
//   d       out - in of the table, CO units
//   g       factor of the table;  d and g are linear between points and constant beyond the ends
//   r, w    thresholds, CO units, >= 0, and one weight per threshold, -
//   b, a    numerator and denominator by rising powers of p, s^k; no pole to the right of -1e-6 1/s
//
// Severity s fades each in as u + s (y - u).
// Errors: the steps have no exceptions; model/effects/learned/learned_descriptor.cpp rejects
// invalid tables, check_poles() invalid denominators.
// Limits: it doesn't explain a cause. It describes the behaviour during the moves of one record, at
// the openings, sizes and times of that record. Beyond them the end values apply.
//
// Source: Krejci and Kuhnen, IEE Proc. Control Theory Appl. 148 (2001) 185-192 (play operators);
// Wahlberg, IEEE Trans. Automatic Control 36 (1991) 551-562 (Laguerre filters); de Boor, A
// Practical Guide to Splines (1978).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace loopwarden::effects {

using Points = std::vector<std::pair<double, double>>;

// Returns the value at `x`: linear between points, constant beyond the ends. At least one point;
// the first coordinate rises.
double interpolate(const Points& points, double x) noexcept;

class LearnedCurve {
 public:
  static constexpr bool kActsOnFlow = true;

  explicit LearnedCurve(Points in_out) : offsets_(std::move(in_out)) {
    for (auto& [in, out] : offsets_) out -= in;
  }
  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept { return step(u); }
  double step(double u) noexcept { return u + severity_ * interpolate(offsets_, u); }

 private:
  Points offsets_;  // CO units
  double severity_ = 1.0;
};

class LearnedPlay {
 public:
  LearnedPlay(Points thresholds_weights, double offset)
      : plays_(std::move(thresholds_weights)), at_(plays_.size()), offset_(offset) {}
  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept {
    std::fill(at_.begin(), at_.end(), u);
    return step(u);
  }
  double step(double u) noexcept {
    double y = offset_;
    for (std::size_t j = 0; j < plays_.size(); ++j) {
      at_[j] = std::clamp(at_[j], u - plays_[j].first, u + plays_[j].first);
      y += plays_[j].second * at_[j];
    }
    return u + severity_ * (y - u);
  }

 private:
  Points plays_;  // half width, CO units, and weight
  std::vector<double> at_;
  double offset_;  // CO units
  double severity_ = 1.0;
};

class LearnedGain {
 public:
  LearnedGain(Points at_factor, bool over_time)
      : factors_(std::move(at_factor)), over_time_(over_time) {}
  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept { return step(u, 0.0); }
  double step(double u, double time_s) noexcept {
    return u + severity_ * (interpolate(factors_, over_time_ ? time_s : u) - 1.0) * u;
  }

 private:
  Points factors_;
  bool over_time_;
  double severity_ = 1.0;
};

class LearnedFilter {
 public:
  static constexpr std::size_t kMostOrder = 3;
  using Coefficients = std::array<double, kMostOrder + 1>;  // rising powers, zero beyond the order

  LearnedFilter(const Coefficients& numerator, const Coefficients& denominator, double period_s);

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept;
  // As in FirstOrderLag, y responds to u within the sample.
  double step(double u) noexcept {
    State next{};
    for (std::size_t i = 0; i < order_; ++i) {
      next[i] = input_[i] * u;
      for (std::size_t j = 0; j < order_; ++j) next[i] += keep_[i][j] * state_[j];
    }
    state_ = next;
    return output(u);
  }

 private:
  using State = std::array<double, kMostOrder>;

  double output(double u) const noexcept {
    double y = through_ * u;
    for (std::size_t i = 0; i < order_; ++i) y += weights_[i] * state_[i];
    return u + severity_ * (y - u);
  }

  std::size_t order_;
  std::array<State, kMostOrder> keep_{};
  State input_{};
  State weights_{};
  double through_ = 0.0;
  double at_rest_ = 0.0;  // first state at rest for an input of 1
  State state_{};
  double severity_ = 1.0;
};

// Returns the reason why the poles are not allowed, or an empty text if they are.
std::string check_poles(const LearnedFilter::Coefficients& denominator);

}  // namespace loopwarden::effects
