// SPDX-License-Identifier: Apache-2.0
// What the sources of Fitter share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "model/gap/fit.hpp"
#include "model/numeric/subplex.hpp"

namespace loopwarden::gap {

struct Fitter::Work {
  std::vector<std::vector<double>> columns;
  std::vector<std::vector<double>> white;
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  Eigen::VectorXd solved;
  std::vector<double> target;             // white, what `solved` fits
  std::vector<double> whole;              // PV units, of the solution
  std::vector<double> shown;              // PV units, of it as the transmitter shows it
  std::vector<std::vector<double>> seen;  // of the columns
};

inline constexpr std::size_t kLittleLoad = 1;  // index of the filter
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline bool solves_gain(const Terms& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Candidate* t) { return t->solves_gain; });
}

// From `x`, 0 to 1 in each direction, until a step brings less than `least_gain`.
inline void minimise(std::vector<double>& x, std::vector<double> steps, int evaluations,
                     double least_gain, const numeric::Objective& objective) {
  numeric::subplex(x, std::move(steps), 0.0, 1.0, objective,
                   {.most_evaluations = evaluations, .value_change = least_gain});
}

}  // namespace loopwarden::gap
