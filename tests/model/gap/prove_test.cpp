// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <catch2/catch.hpp>

namespace prove_test {

using namespace loopwarden::gap;

TEST_CASE("over noise the innovations of the last third judge", "[gap][prove]") {
  Trial t{.rest_is_noise = true, .model_innovations = 100.0, .choice_innovations = 50.0};
  CHECK_FALSE(refuted(t));
  // What shows only before the holdout can't be better there, but must not be worse.
  t.choice_innovations = 104.9;
  CHECK_FALSE(refuted(t));
  t.choice_innovations = 105.1;
  CHECK(refuted(t));
}

TEST_CASE("over more than noise the free runs judge", "[gap][prove]") {
  Trial t{.rest_is_noise = false, .model_rmse = 1.0, .choice_rmse = 0.79};
  CHECK_FALSE(refuted(t));
  t.choice_rmse = 0.81;
  CHECK(refuted(t));
  // The innovations have no say then.
  t.choice_innovations = 1e9;
  t.choice_rmse = 0.1;
  CHECK_FALSE(refuted(t));
}

}  // namespace prove_test
