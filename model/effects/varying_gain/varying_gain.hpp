// SPDX-License-Identifier: Apache-2.0
// A gain that changes during the record (effect `varying_gain`).
//
//   x = F(t) u
//
// F is a smooth curve through the points (t, factor), constant before the first and after the last
// point. It consists of cubic Hermite pieces. The slope at a point is the harmonic mean of the two
// adjacent straight slopes, or 0 if they differ in sign.
//
//   u, x  CO units, at the input of the process     F  factor, > 0     t  s, time of the record
//
// Severity p fades it in as factor 1 + p (F - 1). Between two points F stays between their factors.
// Errors: no exceptions. The points must rise in t; 2 to kMostPoints points.
// Limits: no gain that depends on the opening, which is `valve_characteristic`.
//
// Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304 (monotone pieces).
#pragma once

#include <array>
#include <cstddef>

namespace loopwarden::effects {

class VaryingGain {
 public:
  static constexpr std::size_t kMostPoints = 12;
  struct Point {
    double time_s;
    double factor;
  };
  struct Parameters {
    std::array<Point, kMostPoints> points{};
    std::size_t point_count = 0;
  };

  explicit VaryingGain(const Parameters& parameters) noexcept : p_(parameters) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept { return u * (1.0 + severity_ * (p_.points[0].factor - 1.0)); }
  double step(double u, double time_s) noexcept {
    return u * (1.0 + severity_ * (factor(time_s) - 1.0));
  }

  double factor(double time_s) const noexcept {
    const std::size_t last = p_.point_count - 1;
    if (!(time_s > p_.points[0].time_s)) return p_.points[0].factor;
    if (time_s >= p_.points[last].time_s) return p_.points[last].factor;
    std::size_t i = 0;
    while (time_s >= p_.points[i + 1].time_s) ++i;
    const Point& a = p_.points[i];
    const Point& b = p_.points[i + 1];
    const double length = b.time_s - a.time_s;
    const double s = (time_s - a.time_s) / length;
    const double r = 1.0 - s;
    return r * r * ((1.0 + 2.0 * s) * a.factor + s * length * slope(i)) +
           s * s * ((3.0 - 2.0 * s) * b.factor - r * length * slope(i + 1));
  }

 private:
  double straight(std::size_t i) const noexcept {  // from point i to the next, 1/s
    return (p_.points[i + 1].factor - p_.points[i].factor) /
           (p_.points[i + 1].time_s - p_.points[i].time_s);
  }
  double slope(std::size_t i) const noexcept {          // at point i, 1/s
    if (i == 0 || i + 1 >= p_.point_count) return 0.0;  // constant beyond this point
    const double before = straight(i - 1);
    const double after = straight(i);
    return before * after > 0.0 ? 2.0 * before * after / (before + after) : 0.0;
  }

  Parameters p_;
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
