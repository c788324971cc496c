// SPDX-License-Identifier: Apache-2.0
// Applies an archive's compression to a signal, written only from its description. For tests of the
// recognition.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace loopwarden::tests {

using Places = std::vector<std::size_t>;

// A sample is stored if it differs from the last stored value by more than the dead band.
inline Places by_exception(const std::vector<double>& x, double dead_band) {
  Places stored{0};
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (std::abs(x[k] - x[stored.back()]) > dead_band) stored.push_back(k);
  }
  if (stored.back() + 1 != x.size()) stored.push_back(x.size() - 1);
  return stored;
}

// Two doors, hinged one deviation above and below the last stored value, open with every sample. If
// the line to a new sample is outside, the previous sample is stored.
inline Places by_swinging_door(const std::vector<double>& x, double deviation) {
  constexpr double kWide = std::numeric_limits<double>::infinity();
  Places stored{0};
  double low = -kWide;
  double high = kWide;
  for (std::size_t k = 1; k < x.size(); ++k) {
    const auto door = [&](std::size_t from, double shift) {
      return (x[k] + shift - x[from]) / static_cast<double>(k - from);
    };
    if (door(stored.back(), 0.0) > high || door(stored.back(), 0.0) < low) {
      stored.push_back(k - 1);
      low = door(k - 1, -deviation);
      high = door(k - 1, deviation);
    } else {
      low = std::max(low, door(stored.back(), -deviation));
      high = std::min(high, door(stored.back(), deviation));
    }
  }
  if (stored.back() + 1 != x.size()) stored.push_back(x.size() - 1);
  return stored;
}

inline std::vector<double> held_between(const std::vector<double>& x, const Places& stored) {
  std::vector<double> out(x.size());
  std::size_t at = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    while (at + 1 < stored.size() && stored[at + 1] <= k) ++at;
    out[k] = x[stored[at]];
  }
  return out;
}

inline std::vector<double> lines_between(const std::vector<double>& x, const Places& stored) {
  std::vector<double> out = x;
  for (std::size_t i = 1; i < stored.size(); ++i) {
    const std::size_t from = stored[i - 1];
    const std::size_t to = stored[i];
    for (std::size_t k = from; k < to; ++k) {
      out[k] = x[from] +
               (x[to] - x[from]) * static_cast<double>(k - from) / static_cast<double>(to - from);
    }
  }
  return out;
}

// Rounds to the digits of a file.
inline std::vector<double> with_decimals(std::vector<double> x, int decimals) {
  const double scale = std::pow(10.0, decimals);
  for (double& v : x) v = std::nearbyint(v * scale) / scale;
  return x;
}

}  // namespace loopwarden::tests
