// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/describing_function.hpp"

#include <cmath>
#include <numbers>

namespace loopwarden::analysis {
namespace {
constexpr double kPi = std::numbers::pi;
}  // namespace

std::complex<double> backlash_describing_function(double deadband, double amplitude) {
  if (!(amplitude > deadband / 2.0)) return 0.0;
  const double ratio = deadband / amplitude;
  const double rest = 1.0 - ratio;
  return {(kPi / 2.0 + std::asin(rest) + rest * std::sqrt(ratio * (2.0 - ratio))) / kPi,
          -ratio * (2.0 - ratio) / kPi};
}

std::complex<double> stiction_describing_function(double s, double j, double amplitude) {
  if (!(amplitude > s / 2.0)) return 0.0;
  const double a = amplitude;
  const double p = std::asin((a - s) / a);
  const double real = a / 2.0 * std::sin(2.0 * p) - 2.0 * a * std::cos(p) - a * (kPi / 2.0 + p) +
                      2.0 * (s - j) * std::cos(p);
  const double imaginary =
      -1.5 * a + a / 2.0 * std::cos(2.0 * p) + 2.0 * a * std::sin(p) - 2.0 * (s - j) * std::sin(p);
  return -std::complex<double>(real, -imaginary) / (kPi * a);
}

}  // namespace loopwarden::analysis
