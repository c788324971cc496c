// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/nonlinearity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kMostSamples = 600;

using Series = std::vector<double>;

// Returns a piece whose ends meet. Ends that differ add a spectrum that the signal doesn't have.
std::span<const double> matched_ends(std::span<const double> y, std::size_t cycle) {
  std::size_t best_from = 0;
  std::size_t best_to = y.size();
  double best = 1e300;
  for (std::size_t from = 0; from < cycle && from + 3 * cycle < y.size(); ++from) {
    for (std::size_t to = y.size() - cycle; to < y.size(); ++to) {
      const double level = y[from] - y[to];
      const double slope = (y[from + 1] - y[from]) - (y[to] - y[to - 1]);
      const double off = level * level + slope * slope;
      if (off >= best) continue;
      best = off;
      best_from = from;
      best_to = to;
    }
  }
  return y.subspan(best_from, best_to - best_from);
}

double foretold(const Series& y) {
  const std::size_t rows = y.size() - Limits::kEmbedding - Limits::kHorizon + 1;
  double sum = 0.0;
  std::array<double, Limits::kNeighbours> nearest{};
  std::array<std::size_t, Limits::kNeighbours> at{};
  for (std::size_t i = 0; i < rows; ++i) {
    nearest.fill(1e300);
    for (std::size_t j = 0; j < rows; ++j) {
      // Rows that overlap are neighbours in time, and not in shape.
      if (i < j + Limits::kEmbedding && j < i + Limits::kEmbedding) continue;
      double distance = 0.0;
      for (std::size_t k = 0; k < Limits::kEmbedding && distance < nearest.back(); ++k) {
        const double off = y[i + k] - y[j + k];
        distance += off * off;
      }
      if (distance >= nearest.back()) continue;
      std::size_t place = Limits::kNeighbours - 1;
      while (place > 0 && nearest[place - 1] > distance) {
        nearest[place] = nearest[place - 1];
        at[place] = at[place - 1];
        --place;
      }
      nearest[place] = distance;
      at[place] = j;
    }
    double mean = 0.0;
    for (const std::size_t j : at) mean += y[j + Limits::kEmbedding - 1 + Limits::kHorizon];
    mean /= static_cast<double>(Limits::kNeighbours);
    const double off = y[i + Limits::kEmbedding - 1 + Limits::kHorizon] - mean;
    sum += off * off;
  }
  return sum / static_cast<double>(rows);
}

class Spectrum {
 public:
  explicit Spectrum(const Series& y) : n_(y.size()), reversals_(y.size()) {
    for (std::size_t k = 0; k < n_; ++k) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n_);
      reversals_[k] = {std::cos(angle), std::sin(angle)};
    }
    for (std::size_t f = 0; f <= n_ / 2; ++f) {
      std::complex<double> sum = 0.0;
      for (std::size_t k = 0; k < n_; ++k) sum += y[k] * std::conj(reversals_[f * k % n_]);
      amplitudes_.push_back(std::abs(sum));
    }
  }

  Series with_random_phases(numeric::Random& random) const {
    std::vector<std::complex<double>> lines(amplitudes_.size());
    for (std::size_t f = 1; f < lines.size(); ++f) {
      const double angle = 2.0 * std::numbers::pi * random.uniform();
      lines[f] = amplitudes_[f] * std::complex<double>(std::cos(angle), std::sin(angle));
    }
    Series y(n_);
    for (std::size_t k = 0; k < n_; ++k) {
      double sum = 0.0;
      for (std::size_t f = 1; f < lines.size(); ++f) {
        const double twice = 2 * f == n_ ? 1.0 : 2.0;
        sum += twice * (lines[f] * reversals_[f * k % n_]).real();
      }
      y[k] = sum / static_cast<double>(n_);
    }
    return y;
  }

 private:
  std::size_t n_;
  std::vector<std::complex<double>> reversals_;
  std::vector<double> amplitudes_;
};

}  // namespace

double nonlinearity(std::span<const double> y, double period, std::uint64_t seed) {
  if (!(period >= 4.0) || static_cast<double>(y.size()) < Limits::kLeastPeriods * period)
    return 0.0;
  const auto factor = static_cast<std::size_t>(
      std::max(1.0, std::floor(period / static_cast<double>(Limits::kSamplesPerCycle))));
  Series thinned = diagnosis::block_means(y, factor);
  if (thinned.size() > kMostSamples) thinned.resize(kMostSamples);
  thinned = diagnosis::detrended(thinned);
  const auto cycle = static_cast<std::size_t>(std::max(3.0, period / static_cast<double>(factor)));
  const std::span<const double> piece = matched_ends(thinned, cycle);
  Series x(piece.begin(), piece.end());
  const double deviation = numeric::deviation(x);
  if (x.size() < 6 * Limits::kEmbedding || !(deviation > 0.0)) return 0.0;
  const double mean = numeric::mean(x);
  for (double& v : x) v = (v - mean) / deviation;
  const double gamma = foretold(x);
  const Spectrum spectrum(x);
  numeric::Random random(seed);
  Series surrogates;
  for (std::size_t s = 0; s < Limits::kSurrogates; ++s)
    surrogates.push_back(foretold(spectrum.with_random_phases(random)));
  const double spread = numeric::deviation(surrogates);
  return spread > 0.0 ? (numeric::mean(surrogates) - gamma) / (3.0 * spread) : 0.0;
}

}  // namespace loopwarden::diagnosis
