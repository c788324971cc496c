// SPDX-License-Identifier: Apache-2.0
#include "model/control/output_limiter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace output_limiter_test {

using namespace loopwarden::control;

TEST_CASE("output stays in its range and reports which limit it reached", "[control][limits]") {
  const OutputLimits limits{.low = 10.0, .high = 90.0};
  const Limited high = limit_output(limits, 95.0, 50.0, 0.1);
  CHECK(high.output == 90.0);
  CHECK(high.at_high);
  CHECK_FALSE(high.at_low);
  const Limited low = limit_output(limits, -5.0, 50.0, 0.1);
  CHECK(low.output == 10.0);
  CHECK(low.at_low);
  CHECK_FALSE(low.at_high);
  const Limited inside = limit_output(limits, 33.0, 50.0, 0.1);
  CHECK(inside.output == 33.0);
  CHECK_FALSE((inside.at_low || inside.at_high || inside.rate_limited));
}

TEST_CASE("output moves no faster than its rate", "[control][limits]") {
  const OutputLimits limits{.rate_per_s = 5.0};
  const Limited up = limit_output(limits, 80.0, 50.0, 0.1);
  CHECK(up.output == Approx(50.5));
  CHECK(up.rate_limited);
  CHECK(limit_output(limits, 20.0, 50.0, 0.1).output == Approx(49.5));
  CHECK(limit_output(limits, 50.3, 50.0, 0.1).output == 50.3);
  CHECK_FALSE(limit_output(limits, 50.3, 50.0, 0.1).rate_limited);
}

TEST_CASE("small moves are suppressed", "[control][limits]") {
  const OutputLimits limits{.deadband = 0.5};
  CHECK(limit_output(limits, 50.4, 50.0, 0.1).output == 50.0);
  CHECK(limit_output(limits, 49.6, 50.0, 0.1).output == 50.0);
  CHECK(limit_output(limits, 50.5, 50.0, 0.1).output == 50.5);
  CHECK(limit_output(limits, 0.3, 0.0, 0.1).output == 0.0);  // also away from a limit
  CHECK(limit_output(limits, 99.7, 100.0, 0.1).output == 100.0);
}

TEST_CASE("a limit is always reached, deadband or not", "[control][limits]") {
  const OutputLimits limits{.low = 0.0, .high = 100.0, .deadband = 0.5};
  CHECK(limit_output(limits, 100.2, 99.8, 0.1).output == 100.0);
  CHECK(limit_output(limits, -1.0, 0.3, 0.1).output == 0.0);

  SECTION("also through a rate limit with steps below the deadband") {
    OutputLimits slow = limits;
    slow.rate_per_s = 1.0;
    double output = 99.0;
    for (int k = 0; k < 11; ++k) output = limit_output(slow, 120.0, output, 0.1).output;
    CHECK(output == 100.0);
  }
}

TEST_CASE("a rate limit with steps below the deadband doesn't hold the output",
          "[control][limits]") {
  const OutputLimits limits{.rate_per_s = 1.0, .deadband = 0.5};
  double output = 50.0;
  for (int k = 0; k < 200; ++k) output = limit_output(limits, 60.0, output, 0.1).output;
  CHECK(output == Approx(60.0).margin(0.5));
}

TEST_CASE("an output outside new limits returns into them, deadband or not", "[control][limits]") {
  const OutputLimits limits{.low = 20.0, .high = 80.0, .deadband = 5.0};
  CHECK(limit_output(limits, 20.5, 18.0, 0.1).output == 20.5);
  CHECK(limit_output(limits, 79.0, 82.0, 0.1).output == 79.0);
}

TEST_CASE("a value that is not a number is passed on for the caller to refuse",
          "[control][limits]") {
  const OutputLimits limits{.rate_per_s = 1.0, .deadband = 0.5};
  CHECK(
      std::isnan(limit_output(limits, std::numeric_limits<double>::quiet_NaN(), 50.0, 0.1).output));
}

}  // namespace output_limiter_test
