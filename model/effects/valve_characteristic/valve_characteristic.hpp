// SPDX-License-Identifier: Apache-2.0
// Inherent flow characteristic of the valve (effect `valve_characteristic`).
//
//   q = lo + (hi - lo) phi(h),   h = (x - lo) / (hi - lo),   phi(0) = 0, phi(1) = 1
//
//   linear            phi = h
//   equal_percentage  phi = (R^h - 1) / (R - 1)       R  rangeability, > 1, typically 30 to 50
//   quick_opening     phi = sqrt(h)
//   butterfly         phi = 1 - cos(90 deg h)         projected free area of a thin disc
//   table             linear between (x, q) points, CO units, both strictly increasing
//
//   x  stem travel, CO units     q  flow in CO units     lo, hi  range of the output, CO units
//
// The equal-percentage valve of IEC 60534, R^(h-1), doesn't close; here it is shifted and scaled so
// that it closes. Outside [0, 1] h counts as the nearest end; a table continues with its end
// slopes.
// Severity p fades it in as x + p (q - x).
//
// Errors: no exceptions; if x is not finite, neither is q.
// Limits: the characteristic is inherent, not installed: no pressure drop in the line, no choking,
// no leakage.
//
// Source: IEC 60534-2-4 (inherent flow characteristics); butterfly by geometry.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace loopwarden::effects {

class ValveCharacteristic {
 public:
  static constexpr bool kActsOnFlow = true;
  enum class Curve : std::uint8_t { linear, equal_percentage, quick_opening, butterfly, table };
  static constexpr std::size_t kMostPoints = 20;
  struct Parameters {
    Curve curve = Curve::linear;
    double rangeability = 30.0;
    std::array<std::pair<double, double>, kMostPoints> points{};  // CO units
    std::size_t point_count = 0;                                  // at least 2 for a table
  };

  ValveCharacteristic(const Parameters& parameters, double low, double high) noexcept;

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double x) noexcept { return step(x); }
  double step(double x) noexcept { return x + severity_ * (flow(x) - x); }

 private:
  double flow(double x) const noexcept;

  Parameters parameters_;
  double low_;        // CO units
  double high_;       // CO units
  double log_range_;  // ln R
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
