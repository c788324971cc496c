// SPDX-License-Identifier: Apache-2.0
#include "lab/program/share.hpp"

#include <fmt/format.h>

#include <cmath>

#include "model/numeric/statistics.hpp"

namespace loopwarden::lab {

void Share::count(bool hit) {
  ++of;
  if (hit) ++hits;
}

double Share::percent() const {
  return of == 0 ? std::nan("") : 100.0 * static_cast<double>(hits) / static_cast<double>(of);
}

std::pair<double, double> Share::interval() const {
  const numeric::Range range = numeric::wilson_interval(hits, of);
  return {100.0 * range.low, 100.0 * range.high};
}

std::string Share::text() const {
  if (of == 0) return "- of 0";
  const auto [low, high] = interval();
  return fmt::format("{:.1f} % ({:.1f} to {:.1f}) of {}", percent(), low, high, of);
}

}  // namespace loopwarden::lab
