// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/subplex.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace subplex_test {

using namespace loopwarden::numeric;

TEST_CASE("the minimum of a function with a kink", "[numeric]") {
  std::vector<double> x{0.1, 0.9};
  const double least = subplex(x, {0.2, 0.2}, 0.0, 1.0,
                               [](const std::vector<double>& at) {
                                 return std::abs(at[0] - 0.6) + 3.0 * std::abs(at[1] - 0.3);
                               },
                               {.most_evaluations = 500});
  CHECK(x[0] == Approx(0.6).margin(1e-3));
  CHECK(x[1] == Approx(0.3).margin(1e-3));
  CHECK(least < 5e-3);
}

TEST_CASE("an answer on a bound, from a start next to it, without evaluations outside",
          "[numeric]") {
  bool outside = false;
  std::vector<double> x{0.95};
  subplex(x, {0.3}, 0.0, 1.0,
          [&](const std::vector<double>& at) {
            outside = outside || at[0] < 0.0 || at[0] > 1.0;
            return -at[0];
          },
          {.most_evaluations = 100});
  CHECK(x[0] == Approx(1.0).margin(1e-3));
  CHECK_FALSE(outside);
}

TEST_CASE("values that are not finite are avoided, and the limit of evaluations is kept",
          "[numeric]") {
  int asked = 0;
  std::vector<double> x{0.5};
  subplex(x, {0.2}, 0.0, 1.0,
          [&](const std::vector<double>& at) {
            ++asked;
            return at[0] < 0.3 ? std::nan("") : at[0];
          },
          {.most_evaluations = 60, .parameter_change = 0.0});
  CHECK(x[0] == Approx(0.3).margin(0.01));
  CHECK(asked <= 60);
}

}  // namespace subplex_test
