// SPDX-License-Identifier: Apache-2.0
// PV that rests while CO moves.
#include "model/diagnosis/hold_evidence.hpp"

#include <catch2/catch.hpp>

#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::hold_evidence_test {
namespace {

using namespace diagnosis;

TEST_CASE("PV is constant after a valve that sticks, and moves with a valve that follows") {
  const Series co = made_of(800, [](double k) { return triangle(k / 40.0); });
  const Series jumping = made_of(800, [](double k) { return square(k / 40.0); });
  CHECK(hold_evidence(jumping, co, 40.0) > 0.7);
  CHECK(hold_evidence(co, co, 40.0) < 0.1);
  CHECK(hold_evidence(Series(4, 1.0), Series(4, 1.0), 40.0) == 0.0);
}

}  // namespace
}  // namespace loopwarden::tests::hold_evidence_test
