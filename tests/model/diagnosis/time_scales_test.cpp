// SPDX-License-Identifier: Apache-2.0
// The period of the movement.
#include "model/diagnosis/time_scales.hpp"

#include <catch2/catch.hpp>

#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::time_scales_test {
namespace {

using namespace diagnosis;

TEST_CASE("the movement's period is that of the cycle, or half the record without a cycle") {
  const Series co = with_noise(made_of(800, [](double k) { return sine(k / 50.0); }), 0.05, 1);
  CHECK(movement_period(co, co) == Approx(50.0).epsilon(0.04));
  const Series slow = made_of(800, [](double k) { return sine(k / 200.0); });
  CHECK(movement_period(slow, co) == Approx(50.0).epsilon(0.04));
  CHECK(movement_period(Series(300, 1.0), Series(300, 2.0)) == Approx(150.0));
}

}  // namespace
}  // namespace loopwarden::tests::time_scales_test
