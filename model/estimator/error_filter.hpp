// SPDX-License-Identifier: Apache-2.0
// The error of a hypothesis: noise, an unmeasured disturbance, and the error of the law itself.
//
//   e(k) = d(k) + m(k) + w(k)
//   d(k+1) = a d(k) + v(k)     disturbance      a = exp(-H/R)   var v = q^2 H     d(0) = 0
//   m(k+1) = f m(k) + u(k)     error of the law f = exp(-H/A)   var u = c^2 g(k) (1 - f^2)
//   var w(k) = sigma^2 / n(k)  noise of a block mean
//
//   q  intensity of the disturbance, PV units per root second     R  its return time, s
//   c  size of the law's error, PV units     A  time in which PV answers to CO, s
//   g  activity of CO: the law errs while CO moves     H  length of a block, s
//
// A Kalman filter turns e into independent innovations of variance 1. Its gains depend only on
// (q, c), so the filters of all pairs are made once, and PV and every column pass through the same
// filter: least squares on the results is maximum likelihood.
//   -2 log L = log_determinant + sum of squared innovations + constant
// Source: Kalman, J. Basic Engineering 82 (1960) 35-45.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <span>
#include <vector>

#include "model/estimator/blocks.hpp"

namespace loopwarden::estimator {

// Sizes and times of the error, in PV units and s.
struct ErrorSize {
  double disturbance = 0.0;  // q
  double law = 0.0;          // c
};
struct ErrorTimes {
  double returns_s = 1.0;  // R
  double answer_s = 1.0;   // A
};

class ErrorFilter {
 public:
  // `law_variance`: c^2 g(k) of each block plus what else is known of it, PV units squared.
  ErrorFilter(const Blocks& blocks, ErrorTimes times, double disturbance,
              std::span<const double> law_variance);

  // Innovations over their standard deviation, one per block; 0 for a missing block.
  void whiten(std::span<const double> in, std::span<double> out) const noexcept;
  // The same for four columns, which takes hardly longer than one.
  void whiten_four(const double* const in[4], double* const out[4]) const noexcept;

  double log_determinant() const noexcept { return log_determinant_; }
  // Log of the deviation of each innovation, PV units; 0 for a missing block.
  Eigen::VectorXd log_scales() const;

 private:
  struct Gain {
    double disturbance, law, scale;
  };
  double keep_disturbance_;
  double keep_law_;
  std::vector<Gain> gains_;
  double log_determinant_ = 0.0;
};

// The activity g of CO: 0.1 at rest, 1 on average while it moves.
std::vector<double> activity(const Blocks& blocks, std::span<const double> co, double dead_time_s,
                             double answer_s);

// The filters of all pairs (q, c).
class ErrorGrid {
 public:
  // `largest_disturbance`: PV units per root second.
  ErrorGrid(const Blocks& blocks, ErrorTimes times, double pv_span, double largest_disturbance,
            std::vector<double> activity);

  std::size_t disturbances() const noexcept { return disturbance_.size(); }
  std::size_t laws() const noexcept { return law_.size(); }
  std::size_t size() const noexcept { return filters_.size(); }
  std::size_t index(std::size_t disturbance, std::size_t law) const noexcept {
    return disturbance * law_.size() + law;
  }
  const ErrorFilter& at(std::size_t index) const noexcept { return filters_[index]; }
  ErrorSize size_at(std::size_t index) const noexcept {
    return {disturbance_[index / law_.size()], law_[index % law_.size()]};
  }
  // The filter of a pair, with more variance of the law at some blocks.
  ErrorFilter with_jumps(std::size_t index, std::span<const double> more) const;

 private:
  const Blocks& blocks_;
  ErrorTimes times_;
  std::vector<double> activity_;
  std::vector<double> disturbance_;  // q, PV units per root second
  std::vector<double> law_;          // c, PV units
  std::vector<ErrorFilter> filters_;
};

}  // namespace loopwarden::estimator
