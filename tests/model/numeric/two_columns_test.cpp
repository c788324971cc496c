// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/two_columns.hpp"

#include <catch2/catch.hpp>

namespace two_columns_test {

using loopwarden::numeric::TwoColumns;

TEST_CASE("least squares on two columns: exact, with an error, and no answer for equal columns",
          "[numeric]") {
  TwoColumns exact;
  TwoColumns rest;
  TwoColumns one;
  for (int k = 0; k < 10; ++k) {
    const double a = k - 4.5;
    const double b = k % 2 == 0 ? 1.0 : -1.0;
    exact.add(a, b, 3.0 * a - 2.0 * b);
    rest.add(a, b, 3.0 * a - 2.0 * b + (k == 0 ? 1.0 : 0.0));
    one.add(a, 2.0 * a, a);
  }
  REQUIRE_FALSE(exact.depends(1e-12));
  CHECK(exact.p() == Approx(3.0));
  CHECK(exact.q() == Approx(-2.0));
  CHECK(exact.left() == Approx(0.0).margin(1e-9));
  CHECK(rest.left() > 0.1);
  CHECK(rest.left() < 1.0);
  CHECK(one.depends(1e-12));
}

}  // namespace two_columns_test
