// SPDX-License-Identifier: Apache-2.0
// Subplex: finds the minimum of a function within bounds without derivatives, by simplex searches
// in subspaces. It suits functions with kinks and small jumps. It is part of NLopt, so users of
// this header link NLopt.
//
// A function value that is not finite counts as very large.
//
//   x  scaled so that each of `steps` is a sensible first step
//
// Errors: std::invalid_argument from NLopt if the start is outside the bounds.
// Limits: it can't leave a valley whose walls are wider than the first steps; at most about twenty
// parameters.
//
// Sources: Rowan, Functional Stability Analysis of Numerical Algorithms (thesis, University of
// Texas, 1990); Johnson, The NLopt nonlinear-optimization package (LN_SBPLX).
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <nlopt.hpp>
#include <vector>

namespace loopwarden::numeric {

struct SubplexSettings {
  int most_evaluations = 200;
  // The search stops when the value changes by less than `value_change` (0: not used) or every
  // parameter by less than `parameter_change`.
  double value_change = 0.0;
  double parameter_change = 1e-4;
};

using Objective = std::function<double(const std::vector<double>& x)>;

// Searches from `x`, moves `x` to the best point within [low, high], and returns the least value. A
// first step that would leave the bounds is reversed.
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
    // `x` has the best point so far.
  }
  return reached;
}

}  // namespace loopwarden::numeric
