// SPDX-License-Identifier: Apache-2.0
// Bounded nonlinear least squares by the method of Levenberg and Marquardt.
//
//   least  sum r_i(x)^2   with  low <= x <= high
//   (J'J + d diag(J'J)) move = -J' r,   x <- x + move, cut to the bounds,   d  damping
//
// J is computed by differences, in the direction away from a near bound. A parameter at a bound
// stays there for the step if the gradient pushes it against the bound. A move that reduces the sum
// is accepted and the damping is reduced; otherwise the move is computed again with more damping
// and the same J.
//
//   x  scaled so that a step of `difference` shows in r but stays nearly linear
//
// Errors: no exceptions. If the first residual is not finite, the start is the answer; a move to a
// residual that is not finite is rejected.
// Limits: it finds only the valley that it starts in; it can't follow an r that jumps (see
// subplex.hpp, evolution.hpp); in a flat direction the choice between parameters is arbitrary.
//
// Sources: Marquardt, J. SIAM 11 (1963) 431-441; bounds by an active set: Nocedal and Wright,
// Numerical Optimization (Springer 2006), section 16.7.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

namespace loopwarden::numeric {

struct Parameter {
  double value = 0.0;  // start, clamped to the bounds
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  // The step for differences is the greater of this and `relative_difference` |x|.
  double difference = 1e-6;
  double relative_difference = 0.0;
  double largest_move = std::numeric_limits<double>::infinity();  // in one step
};

struct LeastSquaresSettings {
  int most_steps = 80;          // each computes one J
  int most_attempts = 16;       // dampings tried with one J
  double first_damping = 1e-3;  // share of the diagonal
  double least_damping = 1e-12;
  double easing = 0.2;      // factor on the damping after an accepted move
  double tightening = 8.0;  // factor after a rejected move
  // The search stops after a move that reduces the sum of squares by less than this share.
  double least_gain = 1e-14;
};

struct LeastSquares {
  std::vector<double> x;
  Eigen::VectorXd residual;
  double sum_squares = 0.0;
};

// Fills r(x); the number of values is the same in every call.
using Residual = std::function<void(const std::vector<double>& x, Eigen::VectorXd& r)>;

// Returns the parameters with the least sum of squares, their residual and that sum.
LeastSquares least_squares(const std::vector<Parameter>& parameters, const Residual& residual,
                           const LeastSquaresSettings& settings = {});

// Returns the step of Levenberg and Marquardt from `x`. Parameters that push against a bound stay
// there.
Eigen::VectorXd damped_move(const std::vector<Parameter>& parameters, const std::vector<double>& x,
                            const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient,
                            double damping);
// Returns `x` after a move, within the bounds. No parameter moves by more than its largest move.
std::vector<double> moved(const std::vector<Parameter>& parameters, const std::vector<double>& x,
                          const Eigen::VectorXd& move);

// Returns dr/dx at `x` by differences. `r` is the residual at `x`; `parameters` has the bounds and
// steps.
Eigen::MatrixXd jacobian(const std::vector<Parameter>& parameters, const Residual& residual,
                         const std::vector<double>& x, const Eigen::VectorXd& r);

}  // namespace loopwarden::numeric
