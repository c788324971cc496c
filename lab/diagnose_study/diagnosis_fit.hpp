// SPDX-License-Identifier: Apache-2.0
// Statistics of a small set of labelled loops: ridge logistic regression, area under the curve,
// bootstrap intervals over loops.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace loopwarden::lab {

// Terms of the decision (model/diagnosis/decision.hpp): log odds of a band, standing, CO turns by
// travel, CO turns by time.
using ValveTerms = std::array<double, 4>;
struct ValveWeights {
  double base = 0.0;
  ValveTerms per{};
};
struct LogisticRow {
  ValveTerms x{};
  bool positive = false;
  double weight = 1.0;
};
// Maximises the likelihood minus ridge/2 times the squared weights of the terms, scaled by their
// usual spread. The rows' weights are scaled to a mean of 1.
ValveWeights fit_logistic(std::span<const LogisticRow> rows, double ridge);

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
