// SPDX-License-Identifier: Apache-2.0
#include "model/gap/accept.hpp"

#include <catch2/catch.hpp>
#include <vector>

namespace accept_test {

using namespace loopwarden::gap;

namespace {

// Far from every limit.
constexpr Addition kFirst{
    .score_with = 100.0, .score_without = 0.0, .first = true, .moves_pv = 0.5, .least_rms = 0.1};
constexpr Addition kFurther{.score_with = 200.0,
                            .score_without = 100.0,
                            .first = false,
                            .moves_pv = 0.5,
                            .least_rms = 0.1,
                            .left_out_nats = 50.0,
                            .block_t = 5.0,
                            .rmse_with = 0.2,
                            .rmse_without = 0.3,
                            .rmse_model = 0.5,
                            .noise_rms = 0.1};

}  // namespace

TEST_CASE("a first effect needs five nats", "[gap][accept]") {
  Addition a = kFirst;
  CHECK(worth_adding(a));
  a.score_with = 5.01;
  CHECK(worth_adding(a));
  a.score_with = 4.99;
  CHECK_FALSE(worth_adding(a));
  // It need not gain everywhere: the size of the record's own error is not known yet.
  a = kFirst;
  a.block_t = -1.0;
  CHECK(worth_adding(a));
}

TEST_CASE("a further effect needs twelve nats, on blocks left out too", "[gap][accept]") {
  Addition a = kFurther;
  CHECK(worth_adding(a));
  a.score_with = 112.01;
  a.left_out_nats = 12.01;
  CHECK(worth_adding(a));
  a.score_with = 111.99;
  CHECK_FALSE(worth_adding(a));
  a.score_with = 112.01;
  a.left_out_nats = 11.99;
  CHECK_FALSE(worth_adding(a));
  a.at_one_moment = true;  // the block in which it shows can't be predicted
  CHECK(worth_adding(a));
}

TEST_CASE("a further effect closes a twentieth of the gap", "[gap][accept]") {
  // 0.05 (0.5^2 - 0.1^2) = 0.012 = 0.3^2 - 0.2793^2
  Addition a = kFurther;
  a.rmse_with = 0.279;
  CHECK(worth_adding(a));
  a.rmse_with = 0.2795;
  CHECK_FALSE(worth_adding(a));
  CHECK(closes_a_part(0.279, 0.3, 0.5, 0.1));
  CHECK_FALSE(closes_a_part(0.2795, 0.3, 0.5, 0.1));
}

TEST_CASE("a further effect gains everywhere in the record, unless it shows at one moment",
          "[gap][accept]") {
  Addition a = kFurther;
  a.block_t = 1.71;
  CHECK(worth_adding(a));
  a.block_t = 1.69;
  CHECK_FALSE(worth_adding(a));
  a.at_one_moment = true;
  CHECK(worth_adding(a));
}

TEST_CASE("a further effect makes the free run better", "[gap][accept]") {
  Addition a = kFurther;
  a.rmse_with = 0.301;
  CHECK_FALSE(worth_adding(a));
  a.first = true;  // a load may move PV away from any first effect
  CHECK(worth_adding(a));
}

TEST_CASE("the search continues if the error is more than noise and trifles", "[gap][accept]") {
  CHECK(leaves_more(0.0501, {0.03, 0.04}));
  CHECK_FALSE(leaves_more(0.0499, {0.03, 0.04}));
}

TEST_CASE("an effect that does not move PV is not missing, however sure it is", "[gap][accept]") {
  for (Addition a : {kFirst, kFurther}) {
    a.moves_pv = 0.101;
    CHECK(worth_adding(a));
    a.moves_pv = 0.099;
    CHECK_FALSE(worth_adding(a));
  }
}

TEST_CASE("an effect is removed if the others do nearly as well without it", "[gap][accept]") {
  CHECK(superfluous(100.0, 88.01));
  CHECK_FALSE(superfluous(100.0, 87.99));
}

TEST_CASE("the remainder of a larger set replaces a likelier one that closes no gap",
          "[gap][accept]") {
  const EffectSet stiction{{"stiction"}, 60.0, 0.05};
  const EffectSet step{{"step_disturbance"}, 76.0, 0.0995};
  CHECK(replaces(stiction, step, 0.1, 0.0));
  CHECK_FALSE(replaces(stiction, {{"step_disturbance"}, 76.0, 0.097}, 0.1, 0.0));
  CHECK_FALSE(replaces({{"stiction"}, 60.0, 0.098}, step, 0.1, 0.0));
  CHECK(replaces({{"stiction"}, 76.1, 0.098}, step, 0.1, 0.0));
}

TEST_CASE("a name leads over the best explanation without it, of as many effects or fewer",
          "[gap][accept]") {
  const EffectSet chosen{{"gain_change", "stiction"}, 90.0};
  const std::vector<EffectSet> tried{{{"gain_change"}, 20.0},
                                     {{"backlash"}, 30.0},
                                     {{"backlash", "gain_change"}, 60.0},
                                     {{"drift", "extra_lag", "backlash"}, 85.0},
                                     {{"stiction"}, 40.0}};
  CHECK(leads(chosen, tried) == std::vector<double>{50.0, 30.0});
  // The model without an effect is a rival, too.
  CHECK(leads({{"drift"}, 7.0}, std::vector<EffectSet>{{{"extra_lag"}, -3.0}}) ==
        std::vector<double>{7.0});
}

TEST_CASE("an effect at a place that CO doesn't show is no rival", "[gap][accept]") {
  EffectSet cam{{"cam_obstruction"}, 60.0};
  const EffectSet stiction{{"stiction"}, 50.0};
  CHECK(leads(stiction, std::vector<EffectSet>{cam, stiction}) == std::vector<double>{-10.0});
  cam.placed = false;
  CHECK(leads(stiction, std::vector<EffectSet>{cam, stiction}) == std::vector<double>{50.0});
}

}  // namespace accept_test
