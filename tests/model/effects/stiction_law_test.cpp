// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_law.hpp"

#include <catch2/catch.hpp>

namespace stiction_law_test {

using loopwarden::effects::StictionParameters;

TEST_CASE("friction from the paper's two numbers", "[plant][stiction]") {
  constexpr StictionParameters kLaw{.s = 5.0, .j = 2.0};
  CHECK(kLaw.static_friction() == 3.5);
  CHECK(kLaw.moving_friction() == 1.5);
  CHECK(kLaw.static_friction() + kLaw.moving_friction() == kLaw.s);
  CHECK(kLaw.static_friction() - kLaw.moving_friction() == kLaw.j);
}

}  // namespace stiction_law_test
