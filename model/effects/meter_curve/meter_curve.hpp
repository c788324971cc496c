// SPDX-License-Identifier: Apache-2.0
// A reading that is distorted by a wrong curve (effect `meter_curve`).
//
//   y = q + S (f(q) - q),   h = (q - lo) / (hi - lo), 0 to 1
//
//   root    f = lo + (hi - lo) sqrt(h)   the root is applied twice, or to a flow that needs no root
//   square  f = lo + (hi - lo) h^2       the root is missing
//   table   linear between (q, y) points, PV units, both strictly increasing
//
//   q, y    PV units, output of the transmitter with its noise
//   lo, hi  range of the transmitter, PV units     S  share of the curve, 0 to 1
//
// The slope of the root is infinite at lo. Below a thousandth of the range a straight line replaces
// the root, as in transmitters. Outside the range q counts as the nearest end; a table continues
// with its end slopes.
// Severity p fades it in as q + p (y - q).
//
// Errors: no exceptions; if q is not a number, neither is y.
// Limits: no dependence on density or temperature; noise before and after the curve is not
// separate.
//
// Source: IEC 60770-1 and ISO 5167-1 (flow from differential pressure, by its root).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "model/effects/point_table.hpp"

namespace loopwarden::effects {

class MeterCurve {
 public:
  static constexpr bool kActsOnReading = true;
  enum class Curve : std::uint8_t { root, square, table };
  static constexpr std::size_t kMostPoints = 16;
  struct Parameters {
    Curve curve = Curve::root;
    double share = 1.0;
    std::array<std::pair<double, double>, kMostPoints> points{};  // PV units
    std::size_t point_count = 0;                                  // at least 2 for a table
  };

  MeterCurve(const Parameters& parameters, double low, double high) noexcept
      : parameters_(parameters), low_(low), high_(high) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double q) noexcept { return step(q); }
  double step(double q) noexcept {
    const double by = severity_ * (parameters_.curve == Curve::table ? 1.0 : parameters_.share);
    return q + by * (shown(q) - q);
  }

 private:
  double shown(double q) const noexcept {
    if (parameters_.curve == Curve::table) {
      return on_lines(parameters_.points, parameters_.point_count, q);
    }
    const double h = std::clamp((q - low_) / (high_ - low_), 0.0, 1.0);
    constexpr double kStraight = 1e-3;
    const double share = parameters_.curve == Curve::square ? h * h
                         : h < kStraight                    ? h / std::sqrt(kStraight)
                                                            : std::sqrt(h);
    return low_ + (high_ - low_) * share;
  }
  Parameters parameters_;
  double low_;   // PV units
  double high_;  // PV units
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
