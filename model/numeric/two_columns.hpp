// SPDX-License-Identifier: Apache-2.0
// Least squares of y on two columns a and b without a constant, from sums: y = p a + q b.
//
//   p = (S_bb S_ay - S_ab S_by) / D,   q = (S_aa S_by - S_ab S_ay) / D
//   D = S_aa S_bb - S_ab^2,            S_xy = sum x y
//
// Errors: no exceptions; if `depends` returns true, the columns are proportional and there is no
// answer.
#pragma once

#include <algorithm>
#include <cstddef>

namespace loopwarden::numeric {

struct TwoColumns {
  double aa = 0.0, ab = 0.0, bb = 0.0, ay = 0.0, by = 0.0, yy = 0.0;
  std::size_t count = 0;

  void add(double a, double b, double y) noexcept {
    aa += a * a;
    ab += a * b;
    bb += b * b;
    ay += a * y;
    by += b * y;
    yy += y * y;
    ++count;
  }
  double determinant() const noexcept { return aa * bb - ab * ab; }
  // Returns whether D is at most `share` times the D of orthogonal columns.
  bool depends(double share) const noexcept { return !(determinant() > share * aa * bb); }
  double p() const noexcept { return (bb * ay - ab * by) / determinant(); }
  double q() const noexcept { return (aa * by - ab * ay) / determinant(); }
  // Returns the sum of the squared errors y - p a - q b.
  double left() const noexcept { return std::max(0.0, yy - p() * ay - q() * by); }
};

}  // namespace loopwarden::numeric
