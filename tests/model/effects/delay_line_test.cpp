// SPDX-License-Identifier: Apache-2.0
#include "model/effects/delay_line.hpp"

#include <catch2/catch.hpp>

namespace delay_line_test {

using loopwarden::effects::DelayLine;

TEST_CASE("a delay line returns every input within its delay", "[plant][delay]") {
  const std::size_t samples = GENERATE(0U, 1U, 2U, 3U, 7U, 8U, 26U);
  DelayLine line(samples);
  line.fill(-1.0);
  for (std::size_t k = 0; k < 100; ++k) {
    line.push(static_cast<double>(k));
    for (std::size_t age = 0; age <= samples; ++age) {
      REQUIRE(line.at(age) == (k >= age ? static_cast<double>(k - age) : -1.0));
    }
  }
}

}  // namespace delay_line_test
