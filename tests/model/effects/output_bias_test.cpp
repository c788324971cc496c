// SPDX-License-Identifier: Apache-2.0
#include "model/effects/output_bias/output_bias.hpp"

#include <catch2/catch.hpp>

namespace output_bias_test {

using loopwarden::effects::OutputBias;

TEST_CASE("the bias is added, scaled by severity", "[plant][bias]") {
  OutputBias bias(-0.3);
  CHECK(bias.reset(5.0) == Approx(4.7));
  CHECK(bias.step(2.0) == Approx(1.7));
  bias.set_severity(0.5);
  CHECK(bias.step(2.0) == Approx(1.85));
  bias.set_severity(0.0);
  CHECK(bias.step(2.0) == 2.0);
}

}  // namespace output_bias_test
