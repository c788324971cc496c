// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace prove_test {

using namespace loopwarden::gap;

TEST_CASE("the gap closed counts from the floor, and only where there is a gap", "[gap][prove]") {
  CHECK(gap_closed(1.0, 0.1, 0.1) == Approx(1.0));
  CHECK(gap_closed(1.0, 1.0, 0.1) == 0.0);
  CHECK(gap_closed(1.0, std::sqrt(0.5), 0.0) == Approx(0.5));
  CHECK(gap_closed(1.0, 30.0, 0.1) == -1.0);  // worse than before, without end
  CHECK(gap_closed(1.0, 0.01, 0.1) == 1.0);
  CHECK(std::isfinite(gap_closed(0.201, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.199, 0.1, 0.1)));
  CHECK(std::isnan(gap_closed(0.0, 0.0, 0.0)));
}

TEST_CASE("names hold by the gap they close on the last third", "[gap][prove]") {
  const auto at = [](double closed) { return judge({.believable = false, .closed = closed}); };
  CHECK(at(1.0) == Proof::holds);
  CHECK(at(0.801) == Proof::holds);
  CHECK(at(0.799) == Proof::partly);
  CHECK(at(0.501) == Proof::partly);
  CHECK(at(0.499) == Proof::refuted);
  CHECK(at(-1.0) == Proof::refuted);
  // A missed slip makes innovations no better; what the free run closes decides.
  CHECK(judge({.closed = 0.95, .model_innovations = 1.0, .choice_innovations = 2.0}) ==
        Proof::holds);
}

TEST_CASE("where a load wanders, likelier innovations make a name hold partly", "[gap][prove]") {
  // 500 ln(100/98.9) = 5.5 nats
  Trial t{.with_load = true,
          .closed = 0.2,
          .model_innovations = 100.0,
          .choice_innovations = 98.9,
          .innovations = 1000};
  CHECK(judge(t) == Proof::partly);
  t.choice_innovations = 99.1;
  CHECK(judge(t) == Proof::refuted);
  t.choice_innovations = 90.0;
  t.with_load = false;
  CHECK(judge(t) == Proof::refuted);
  t.with_load = true;
  t.rest_is_noise = false;
  CHECK(judge(t) == Proof::refuted);
  t.rest_is_noise = true;
  t.believable = false;
  CHECK(judge(t) == Proof::refuted);
}

TEST_CASE("without a gap to speak of the innovations judge over noise", "[gap][prove]") {
  Trial t{.rest_is_noise = true, .model_innovations = 100.0, .choice_innovations = 50.0};
  CHECK(judge(t) == Proof::holds);
  // What shows only before the holdout can't be better there, but must not be worse.
  t.choice_innovations = 104.9;
  CHECK(judge(t) == Proof::holds);
  t.choice_innovations = 105.1;
  CHECK(judge(t) == Proof::refuted);
  t.choice_innovations = 50.0;
  t.believable = false;
  CHECK(judge(t) == Proof::refuted);
}

TEST_CASE("over noise the free run may be worse only as far as a load makes it so",
          "[gap][prove]") {
  Trial t{.rest_is_noise = true,
          .model_innovations = 100.0,
          .choice_innovations = 50.0,
          .model_rmse = 0.3,
          .choice_rmse = 0.79,
          .floor_rmse = 0.4};
  CHECK(judge(t) == Proof::holds);
  t.choice_rmse = 0.81;
  CHECK(judge(t) == Proof::refuted);
}

TEST_CASE("without a gap to speak of the free runs judge over more than noise", "[gap][prove]") {
  Trial t{.rest_is_noise = false, .model_rmse = 1.0, .choice_rmse = 0.79};
  CHECK(judge(t) == Proof::holds);
  t.choice_rmse = 0.81;
  CHECK(judge(t) == Proof::refuted);
}

}  // namespace prove_test
