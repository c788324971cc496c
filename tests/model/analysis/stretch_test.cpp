// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/stretch.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

namespace loopwarden::tests::stretch_test {
namespace {

using analysis::telling_stretches;

struct Columns {
  std::vector<double> pv = std::vector<double>(40000, 1.0);
  std::vector<double> co = std::vector<double>(40000, 50.0);
  std::vector<double> automatic = std::vector<double>(40000, 1.0);

  void move(std::size_t from, std::size_t to, double size) {
    for (std::size_t k = from; k < to; ++k) co[k] += size * std::sin(0.01 * static_cast<double>(k));
  }
  std::size_t best() const {
    return telling_stretches({.pv = pv, .co = co, .automatic = automatic}, 4000, 1).front();
  }
};

bool around(std::size_t from, std::size_t middle) { return from <= middle && middle < from + 4000; }

TEST_CASE("the stretch in which CO moves most", "[stretch]") {
  Columns c;
  c.move(30000, 34000, 5.0);
  c.move(8000, 12000, 2.0);
  CHECK(around(c.best(), 32000));
}

TEST_CASE("the stretch is neither in manual nor has it holes", "[stretch]") {
  Columns c;
  c.move(30000, 34000, 5.0);
  c.move(8000, 12000, 2.0);
  for (std::size_t k = 29000; k < 35000; ++k) c.automatic[k] = 0.0;
  CHECK(around(c.best(), 10000));
  for (std::size_t k = 0; k < c.automatic.size(); ++k) c.automatic[k] = 1.0;
  for (std::size_t k = 30000; k < 34000; k += 2) c.pv[k] = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 30001; k < 34000; k += 3) c.pv[k] = std::numeric_limits<double>::quiet_NaN();
  CHECK(around(c.best(), 10000));
}

TEST_CASE("one stretch from each part, in order; a short record is taken whole", "[stretch]") {
  Columns c;
  c.move(30000, 34000, 5.0);
  c.move(8000, 12000, 2.0);
  const auto two = telling_stretches({.pv = c.pv, .co = c.co}, 4000, 2);
  REQUIRE(two.size() == 2);
  CHECK(around(two[0], 10000));
  CHECK(around(two[1], 32000));
  CHECK(telling_stretches({.pv = c.pv, .co = c.co}, 40000, 3) == std::vector<std::size_t>{0});
}

}  // namespace
}  // namespace loopwarden::tests::stretch_test
