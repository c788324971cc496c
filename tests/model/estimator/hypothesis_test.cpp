// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/hypothesis.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <string_view>
#include <vector>

#include "model/effects/catalogue.hpp"

namespace hypothesis_test {

using namespace loopwarden;
using namespace loopwarden::estimator;

namespace {

constexpr double kDuration_s = 600.0;

const std::vector<Candidate> kCatalogue = effects::candidates({});

Law named(std::string_view name) {
  const auto found = std::find_if(kCatalogue.begin(), kCatalogue.end(),
                                  [&](const Candidate& c) { return name == c.name; });
  REQUIRE(found != kCatalogue.end());
  return law_of(*found, kDuration_s);
}

}  // namespace

TEST_CASE("backlash and steps of one stem are no pair, because stiction has their form",
          "[estimator][hypothesis]") {
  Law steps = named("resolution");
  CHECK(!compatible(named("backlash"), steps));
  CHECK(!compatible(steps, named("backlash")));
  CHECK(compatible(named("backlash"), named("gain_change")));

  // Steps of the reading leave the stem's band to be found.
  steps.block = effects::Block::transmitter;
  CHECK(compatible(named("backlash"), steps));
}

}  // namespace hypothesis_test
