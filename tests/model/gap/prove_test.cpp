// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace prove_test {

using namespace loopwarden::gap;

TEST_CASE("the gap closed counts from the floor, and only if there is a gap", "[gap][prove]") {
  CHECK(gap_closed(1.0, 0.1, 0.1) == Approx(1.0));
  CHECK(gap_closed(1.0, 1.0, 0.1) == 0.0);
  CHECK(gap_closed(1.0, std::sqrt(0.5), 0.0) == Approx(0.5));
  CHECK(gap_closed(1.0, 30.0, 0.1) == -1.0);  // worse than before, however much
  CHECK(gap_closed(1.0, 0.01, 0.1) == 1.0);
  CHECK(std::isfinite(gap_closed(0.201, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.199, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.0, 0.0, 0.0)));
}

}  // namespace prove_test
