// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/diagnosis_fit.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/random.hpp"

namespace loopwarden::lab {
namespace {

// Spread of the terms, so that the ridge affects them equally.
constexpr ValveTerms kNumberSpread{10.0, 0.25, 0.4, 0.4};
constexpr std::size_t kDescentSteps = 4000;
constexpr double kDescentStep = 0.5;
constexpr std::size_t kResamples = 2000;

}  // namespace

ValveWeights fit_logistic(std::span<const LogisticRow> rows, double ridge) {
  ValveWeights fit;
  double total = 0.0;
  for (const LogisticRow& row : rows) total += row.weight;
  if (total <= 0.0) return fit;
  // Gradient descent on scaled terms: small and convex.
  ValveTerms scaled{};
  const double count = static_cast<double>(rows.size());
  for (std::size_t step = 0; step < kDescentSteps; ++step) {
    double base_slope = 0.0;
    ValveTerms slope{};
    for (const LogisticRow& row : rows) {
      double z = fit.base;
      for (std::size_t i = 0; i < scaled.size(); ++i) z += scaled[i] * row.x[i] / kNumberSpread[i];
      const double miss =
          row.weight / total * ((row.positive ? 1.0 : 0.0) - 1.0 / (1.0 + std::exp(-z)));
      base_slope += miss;
      for (std::size_t i = 0; i < slope.size(); ++i) slope[i] += miss * row.x[i] / kNumberSpread[i];
    }
    fit.base += kDescentStep * base_slope;
    for (std::size_t i = 0; i < scaled.size(); ++i) {
      scaled[i] += kDescentStep * (slope[i] - ridge / count * scaled[i]);
    }
  }
  for (std::size_t i = 0; i < scaled.size(); ++i) fit.per[i] = scaled[i] / kNumberSpread[i];
  return fit;
}

double area_under_curve(std::span<const double> scores, std::span<const bool> positive) {
  double right = 0.0;
  double pairs = 0.0;
  for (std::size_t a = 0; a < scores.size(); ++a) {
    if (!positive[a]) continue;
    for (std::size_t b = 0; b < scores.size(); ++b) {
      if (positive[b]) continue;
      pairs += 1.0;
      right += scores[a] > scores[b] ? 1.0 : scores[a] == scores[b] ? 0.5 : 0.0;
    }
  }
  return pairs > 0.0 ? right / pairs : 0.5;
}

BootstrapInterval bootstrap(std::size_t count, std::uint64_t seed,
                            const std::function<double(std::span<const std::size_t>)>& figure,
                            double share) {
  if (count == 0) return {};
  numeric::Random random(seed);
  std::vector<double> figures;
  std::vector<std::size_t> drawn(count);
  for (std::size_t n = 0; n < kResamples; ++n) {
    for (std::size_t& i : drawn) {
      i = std::min(count - 1,
                   static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
    }
    figures.push_back(figure(drawn));
  }
  std::sort(figures.begin(), figures.end());
  const auto at = [&](double place) {
    return figures[static_cast<std::size_t>(place * static_cast<double>(kResamples - 1))];
  };
  return {at((1.0 - share) / 2.0), at((1.0 + share) / 2.0)};
}

}  // namespace loopwarden::lab
