// SPDX-License-Identifier: Apache-2.0
// PV that dwells and jumps while CO ramps.
#include "model/diagnosis/dwell_asymmetry.hpp"

#include <catch2/catch.hpp>

#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::dwell_asymmetry_test {
namespace {

using namespace diagnosis;

TEST_CASE("a PV that dwells and jumps while CO ramps is distinguished from one that follows CO") {
  const Series co = cycle(triangle);
  const DwellAsymmetry sticking = find_dwell_asymmetry(co, cycle(square, 0.1), kCyclePeriod);
  const DwellAsymmetry following = find_dwell_asymmetry(co, cycle(triangle, -0.1), kCyclePeriod);
  CHECK(sticking.behind_concentration > 0.6);
  CHECK(following.behind_concentration < 0.3);
  CHECK(sticking.output_concentration < 0.2);
  CHECK(sticking.sticky_words > 2.0 * following.sticky_words);
  CHECK(sticking.heavy_tails > following.heavy_tails + 0.5);
}

}  // namespace
}  // namespace loopwarden::tests::dwell_asymmetry_test
