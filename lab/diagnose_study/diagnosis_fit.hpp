// SPDX-License-Identifier: Apache-2.0
// Statistics of a small set of labelled loops: ridge logistic regression, area under the curve,
// bootstrap intervals over loops.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "model/diagnosis/decision.hpp"

namespace loopwarden::lab {

struct LogisticRow {
  diagnosis::ValveTerms x{};
  bool positive = false;
  double weight = 1.0;
};
// Maximises the likelihood minus ridge/2 times the squared weights of the numbers, scaled by their
// usual spread. The weights are between 0 and `most`. The rows' weights are scaled to a mean of 1.
inline constexpr diagnosis::ValveTerms kUnbounded{1e3, 1e3, 1e3, 1e3};
diagnosis::ValveWeights fit_logistic(std::span<const LogisticRow> rows, double ridge,
                                     const diagnosis::ValveTerms& most = kUnbounded);

// Returns the share of pairs that a score puts in the right order; ties count half; 0.5 without
// pairs.
double area_under_curve(std::span<const double> scores, std::span<const bool> positive);

struct BootstrapInterval {
  double low = 0.0;
  double high = 0.0;
};
// Returns the interval that contains `share` of the figures of `count` items drawn with
// replacement. `figure` gets the indices drawn.
BootstrapInterval bootstrap(std::size_t count, std::uint64_t seed,
                            const std::function<double(std::span<const std::size_t>)>& figure,
                            double share = 0.95);

}  // namespace loopwarden::lab
