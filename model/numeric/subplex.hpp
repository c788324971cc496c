// SPDX-License-Identifier: Apache-2.0
// Bounded search for the least value of a function without slopes: Subplex, a simplex search in
// subspaces, for functions with kinks and small jumps. From NLopt, which whoever includes this links.
//
// Where the function is not finite it counts as very large.
//
//   x  scaled so that a first step of `step` is a sensible one in each direction
//
// Errors: std::invalid_argument from NLopt where a start lies outside its bounds.
// What it can't do: leave a valley whose walls are wider than the first steps; more than about twenty
// parameters.
//
// Sources: Rowan, Functional Stability Analysis of Numerical Algorithms (thesis, University of Texas,
// 1990); Johnson, The NLopt nonlinear-optimization package (LN_SBPLX).
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <nlopt.hpp>
#include <vector>

namespace loopwarden::numeric {

struct SubplexSettings {
  int most_evaluations = 200;
  // Content where the value and every parameter change by less.
  double value_change = 0.0;
  double parameter_change = 1e-4;
};

using Objective = std::function<double(const std::vector<double>& x)>;

// From `x`, which it moves to the best place found, within [low, high] in every direction. A first
// step that would leave the bounds goes the other way. Returns the least value.
inline double subplex(std::vector<double>& x, std::vector<double> steps, double low, double high,
                      const Objective& objective, const SubplexSettings& settings) {
  nlopt::opt search(nlopt::LN_SBPLX, static_cast<unsigned>(x.size()));
  search.set_lower_bounds(low);
  search.set_upper_bounds(high);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] + steps[i] > high) steps[i] = -steps[i];
  }
  search.set_initial_step(steps);
  search.set_min_objective(
      [](const std::vector<double>& at, std::vector<double>&, void* data) {
        const double value = (*static_cast<const Objective*>(data))(at);
        return std::isfinite(value) ? value : 1e12;
      },
      const_cast<Objective*>(&objective));
  search.set_maxeval(settings.most_evaluations);
  search.set_ftol_abs(settings.value_change);
  search.set_xtol_abs(settings.parameter_change);
  double reached = std::numeric_limits<double>::infinity();
  try {
    search.optimize(x, reached);
  } catch (const nlopt::roundoff_limited&) {
    // What it had reached is in `x`.
  }
  return reached;
}

}  // namespace loopwarden::numeric
