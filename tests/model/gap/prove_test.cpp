// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace prove_test {

using namespace loopwarden::gap;

TEST_CASE("the gap closed counts from the floor, and only if there is a gap", "[gap][prove]") {
  CHECK(gap_closed(1.0, 0.1, 0.1) == Approx(1.0));
  CHECK(gap_closed(1.0, 1.0, 0.1) == 0.0);
  CHECK(gap_closed(1.0, std::sqrt(0.5), 0.0) == Approx(0.5));
  CHECK(gap_closed(1.0, 30.0, 0.1) == -1.0);  // worse than before, however much
  CHECK(gap_closed(1.0, 0.01, 0.1) == 1.0);
  CHECK(std::isfinite(gap_closed(0.201, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.199, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.0, 0.0, 0.0)));
}

TEST_CASE("a name holds if it closes the gap on the last third", "[gap][prove]") {
  const auto at = [](double closed) { return judge({.believable = false, .closed = closed}); };
  CHECK(at(1.0) == Proof::holds);
  CHECK(at(0.801) == Proof::holds);
  CHECK(at(0.799) == Proof::partly);
  CHECK(at(0.501) == Proof::partly);
  CHECK(at(0.499) == Proof::refuted);
  CHECK(at(-1.0) == Proof::refuted);
  // A missed slip does not improve the innovations. The gap that the free run closes decides.
  CHECK(judge({.closed = 0.95, .model_innovations = 1.0, .choice_innovations = 2.0}) ==
        Proof::holds);
}

TEST_CASE("likelier innovations don't hold a name that closes too little", "[gap][prove]") {
  CHECK(judge({.closed = 0.49, .model_innovations = 100.0, .choice_innovations = 10.0}) ==
        Proof::refuted);
}

TEST_CASE("without a sizeable gap the innovations decide on noise", "[gap][prove]") {
  Trial t{.rest_is_noise = true, .model_innovations = 100.0, .choice_innovations = 50.0};
  CHECK(judge(t) == Proof::holds);
  // An effect that shows only before the holdout can't be better there, but must not be worse.
  t.choice_innovations = 104.9;
  CHECK(judge(t) == Proof::holds);
  t.choice_innovations = 105.1;
  CHECK(judge(t) == Proof::refuted);
  t.choice_innovations = 50.0;
  t.believable = false;
  CHECK(judge(t) == Proof::refuted);
}

TEST_CASE("a free run that gets clearly worse refutes the name", "[gap][prove]") {
  Trial t{.rest_is_noise = true,
          .model_innovations = 100.0,
          .choice_innovations = 50.0,
          .model_rmse = 0.3,
          .choice_rmse = 0.499,
          .trifle_rmse = 0.4};
  CHECK(judge(t) == Proof::holds);
  t.choice_rmse = 0.501;
  CHECK(judge(t) == Proof::refuted);
  t.closed = 0.9;
  CHECK(judge(t) == Proof::refuted);
}

TEST_CASE("without a sizeable gap the free runs decide on more than noise", "[gap][prove]") {
  Trial t{.rest_is_noise = false, .model_rmse = 1.0, .choice_rmse = 0.79};
  CHECK(judge(t) == Proof::holds);
  t.choice_rmse = 0.81;
  CHECK(judge(t) == Proof::refuted);
}

}  // namespace prove_test
