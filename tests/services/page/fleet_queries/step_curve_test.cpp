// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/step_curve.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace loopwarden::tests::step_curve_test {

using namespace fleet;

TEST_CASE("a step without a row has the previous value") {
  const auto curve = step_curve({{1, 5.0, 2.0}, {4, 3.0, 0.0}}, 6);
  REQUIRE(curve.size() == 6);
  CHECK(std::isnan(curve[0]));
  CHECK(std::vector<double>(curve.begin() + 1, curve.end()) ==
        std::vector<double>{5.0, 2.0, 2.0, 3.0, 0.0});
}

TEST_CASE("the value before the first step continues until the next row") {
  CHECK(step_curve({{-1, 9.0, 4.0}, {2, 1.0, 1.0}}, 4) == std::vector<double>{4.0, 4.0, 4.0, 1.0});
}

TEST_CASE("rows after the end are left out, and without rows the curve is unknown") {
  CHECK(step_curve({{0, 1.0, 1.0}, {2, 7.0, 7.0}}, 2) == std::vector<double>{1.0, 1.0});
  for (const double value : step_curve({}, 3)) CHECK(std::isnan(value));
}

}  // namespace loopwarden::tests::step_curve_test
