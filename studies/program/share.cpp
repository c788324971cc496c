// SPDX-License-Identifier: Apache-2.0
#include "studies/program/share.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace loopwarden::studies {

void Share::count(bool hit) {
  ++of;
  if (hit) ++hits;
}

double Share::percent() const {
  return of == 0 ? std::nan("") : 100.0 * static_cast<double>(hits) / static_cast<double>(of);
}

std::pair<double, double> Share::interval() const {
  if (of == 0) return {0.0, 100.0};
  constexpr double z = 1.959963984540054;
  const auto n = static_cast<double>(of);
  const double p = static_cast<double>(hits) / n;
  const double scale = 1.0 + z * z / n;
  const double centre = (p + z * z / (2.0 * n)) / scale;
  const double half = z / scale * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  return {100.0 * std::max(centre - half, 0.0), 100.0 * std::min(centre + half, 1.0)};
}

std::string Share::text() const {
  if (of == 0) return "- of 0";
  const auto [low, high] = interval();
  return fmt::format("{:.1f} % ({:.1f} to {:.1f}) of {}", percent(), low, high, of);
}

}  // namespace loopwarden::studies
