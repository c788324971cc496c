// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/record_input.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace loopwarden::tests::record_input_test {

TEST_CASE("the part of a long record in which the loop moves is kept", "[import]") {
  record::Record r;
  r.period_s = 1.0;
  for (std::size_t k = 0; k < 6000; ++k) {
    const bool moves = k >= 3500 && k < 4500;
    r.time_s.push_back(100.0 + static_cast<double>(k));
    r.pv.push_back(20.0 + (moves ? std::sin(0.05 * static_cast<double>(k)) : 0.0));
    r.sp.push_back(moves && k % 200 < 100 ? 21.0 : 20.0);
    r.co.push_back(50.0 + (moves ? 3.0 * std::sin(0.05 * static_cast<double>(k)) : 0.0));
  }
  r.pv[4000] = std::nan("");
  record::Record all = r;
  workbench::keep_telling_part(all, 3000, "r.csv");
  CHECK(all.size() == 6000);
  workbench::keep_telling_part(r, 1000, "r.csv");
  REQUIRE(r.size() == 1000);
  CHECK(r.sp.size() == 1000);
  CHECK(r.stem.empty());
  CHECK(r.time_s.front() > 100.0 + 3000.0);
  CHECK(r.time_s.back() < 100.0 + 5000.0);
  CHECK(numeric::missing(r.pv) == 1);
}

}  // namespace loopwarden::tests::record_input_test
