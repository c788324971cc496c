// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/series_ops.hpp"

#include <algorithm>
#include <array>

#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
// Four parallel sums: with a single sum each addition waits for the one before.
double dot(const double* a, const double* b, std::size_t count) {
  std::array<double, 4> sums{};
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    for (std::size_t i = 0; i < 4; ++i) sums[i] += a[k + i] * b[k + i];
  }
  double rest = 0.0;
  for (; k < count; ++k) rest += a[k] * b[k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest;
}

Series detrended(std::span<const double> x) {
  const double middle = (static_cast<double>(x.size()) - 1.0) / 2.0;
  const double level = numeric::mean(x);
  double tx = 0.0;
  double tt = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = static_cast<double>(k) - middle;
    tx += t * (x[k] - level);
    tt += t * t;
  }
  const double slope = tt > 0.0 ? tx / tt : 0.0;
  Series out(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    out[k] = x[k] - level - slope * (static_cast<double>(k) - middle);
  }
  return out;
}

Series moving_mean(std::span<const double> x, std::size_t half_width) {
  Series sums(x.size() + 1, 0.0);
  for (std::size_t k = 0; k < x.size(); ++k) sums[k + 1] = sums[k] + x[k];
  Series out(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t from = k > half_width ? k - half_width : 0;
    const std::size_t to = std::min(x.size(), k + half_width + 1);
    out[k] = (sums[to] - sums[from]) / static_cast<double>(to - from);
  }
  return out;
}

Series high_passed(std::span<const double> x, std::size_t window) {
  const double level = numeric::mean(x);
  Series out(x.begin(), x.end());
  for (double& v : out) v -= level;
  const Series slow = moving_mean(out, window / 2);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] -= slow[k];
  return out;
}

Series block_means(std::span<const double> x, std::size_t factor) {
  Series out(x.size() / factor);
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = numeric::mean(x.subspan(k * factor, factor));
  return out;
}

Series medians_of_three(std::span<const double> x) {
  Series y(x.begin(), x.end());
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    y[k] = std::max(std::min(x[k - 1], x[k + 1]), std::min(std::max(x[k - 1], x[k + 1]), x[k]));
  }
  return y;
}

Series central_difference(std::span<const double> x, std::size_t lag) {
  Series out(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    out[k] = x[std::min(x.size() - 1, k + lag)] - x[k > lag ? k - lag : 0];
  }
  return out;
}

}  // namespace loopwarden::diagnosis
