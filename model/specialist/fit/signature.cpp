// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/signature.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopwarden::specialist {

Scaling scaling_of(const std::vector<std::vector<double>>& signatures) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const auto& pv : signatures) {
    for (const double value : pv) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  if (!(low <= high)) return {};
  const double least = 1e-9 * (1.0 + std::abs(low) + std::abs(high));
  return {0.5 * (low + high), std::max(0.5 * (high - low), least)};
}

SignatureMatrix signature_matrix(std::span<const double> pv, const Scaling& scaling) noexcept {
  // Eigen stores a matrix column by column, and the thesis reads it in the same order.
  const Eigen::Map<const SignatureMatrix> samples(pv.data());
  return (samples.array() - scaling.centre) / scaling.half_span;
}

}  // namespace loopwarden::specialist
