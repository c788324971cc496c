// SPDX-License-Identifier: Apache-2.0
// Bounded nonlinear least squares by Levenberg and Marquardt's method.
//
//   least  sum r_i(x)^2   with  low <= x <= high
//   (J'J + d diag(J'J)) move = -J' r,   x <- x + move, cut to the bounds,   d  damping
//
// J by differences, away from a bound that is too near. A parameter at a bound that the gradient
// pushes against stays there for the step. A move that helps is taken and the damping eased; one that
// doesn't is tried again with more damping on the same J.
//
//   x  scaled so that a step of `difference` shows in r but stays nearly linear
//
// Errors: none. Where the first residual is not finite, the start is the answer; moves to where it is
// not finite are not taken.
// What it can't do: find another valley than the one it starts in; follow an r that jumps (see
// subplex.hpp, evolution.hpp); say which of several parameters a flat direction should move.
//
// Sources: Marquardt, J. SIAM 11 (1963) 431-441; bounds by an active set: Nocedal and Wright, Numerical
// Optimization (Springer 2006), section 16.7.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

namespace loopwarden::numeric {

struct Parameter {
  double value = 0.0;  // to start from; cut to the bounds
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  // Of the differences: the greater of this and `relative_difference` |x|.
  double difference = 1e-6;
  double relative_difference = 0.0;
  double largest_move = std::numeric_limits<double>::infinity();  // in one step
};

struct LeastSquaresSettings {
  int most_steps = 80;          // each takes one J
  int most_attempts = 16;       // dampings tried on one J
  double first_damping = 1e-3;  // of the diagonal
  double least_damping = 1e-12;
  double easing = 0.2;      // of the damping, after a move that helped
  double tightening = 8.0;  // after one that did not
  // Content with a move that takes off less than this share of the sum of squares.
  double least_gain = 1e-14;
};

struct LeastSquares {
  std::vector<double> x;
  Eigen::VectorXd residual;
  double sum_squares = 0.0;
};

// Fills r(x); always the same number of values.
using Residual = std::function<void(const std::vector<double>& x, Eigen::VectorXd& r)>;

LeastSquares least_squares(const std::vector<Parameter>& parameters, const Residual& residual,
                           const LeastSquaresSettings& settings = {});

// dr/dx at `x`, where the residual is `r`; its bounds and steps by `parameters`.
Eigen::MatrixXd jacobian(const std::vector<Parameter>& parameters, const Residual& residual,
                         const std::vector<double>& x, const Eigen::VectorXd& r);

}  // namespace loopwarden::numeric
