// SPDX-License-Identifier: Apache-2.0
// The odd phase of PV and CO on textbook shapes.
#include "model/diagnosis/odd_phase.hpp"

#include <catch2/catch.hpp>

#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::odd_phase_test {
namespace {

using namespace diagnosis;

double phase_of(const Series& pv, const Series& co) {
  return odd_phase_evidence(three_time_scales(pv, 40.0), three_time_scales(co, 40.0), 40.0);
}

TEST_CASE("phase: a square wave that lags a triangle is odd, PV in step with CO is even") {
  // Horch 1999: CO integrates the error of a valve that jumps from side to side.
  const Series co = made_of(800, [](double k) { return triangle(k / 40.0); });
  const Series jumping = made_of(800, [](double k) { return square(k / 40.0); });
  CHECK(phase_of(with_noise(jumping, 0.1, 2), co) > 2.0);
  CHECK(phase_of(with_noise(co, 0.1, 3), co) < -3.0);
  Series opposed = co;
  for (double& v : opposed) v = -v;
  CHECK(phase_of(opposed, co) < -3.0);
  CHECK(phase_of(Series(800, 0.0), co) < 0.0);
}

}  // namespace
}  // namespace loopwarden::tests::odd_phase_test
