// SPDX-License-Identifier: Apache-2.0
#include "model/effects/drift/drift.hpp"

#include <catch2/catch.hpp>

namespace drift_test {

using loopwarden::effects::Drift;

TEST_CASE("drift grows with the record's time", "[plant][drift]") {
  Drift drift(-0.02);
  CHECK(drift.reset(5.0) == 5.0);
  CHECK(drift.step(5.0, 0.0) == 5.0);
  CHECK(drift.step(5.0, 100.0) == Approx(3.0));
  CHECK(drift.step(6.0, 250.0) == Approx(1.0));
  drift.set_severity(0.5);
  CHECK(drift.step(5.0, 100.0) == Approx(4.0));
  drift.set_severity(0.0);
  CHECK(drift.step(5.0, 100.0) == 5.0);
}

}  // namespace drift_test
