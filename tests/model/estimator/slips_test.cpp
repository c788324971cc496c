// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/slips.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/estimator/estimator_support.hpp"

namespace slips_test {

using namespace loopwarden;
using namespace loopwarden::estimator;

namespace {

std::vector<double> slow_triangle(std::size_t samples) {
  std::vector<double> co;
  for (std::size_t k = 0; k < samples; ++k) {
    const double phase = std::fmod(static_cast<double>(k) * 0.1, 60.0) / 60.0;
    co.push_back(4.0 + 2.0 * (phase < 0.5 ? 4.0 * phase - 1.0 : 3.0 - 4.0 * phase));
  }
  return co;
}

}  // namespace

TEST_CASE("PV shows the slips of a sticking stem", "[estimator][slips]") {
  plant::LoopModel truth = estimator_test::believed_model();
  truth.valve_effects = {{"stiction", {{"s", 1.6}, {"j", 0.8}}}};
  const Observed observed = estimator_test::record_of(truth, slow_triangle(3000));
  const LoopFacts loop(plant::without_noise(estimator_test::believed_model()));
  const Slips slips = find_slips(observed, loop, 3000, 0.02);
  REQUIRE(slips.count >= 6);
  CHECK(slips.static_friction == Approx(1.2).epsilon(0.15));

  const Observed healthy =
      estimator_test::record_of(estimator_test::believed_model(), slow_triangle(3000));
  CHECK(find_slips(healthy, loop, 3000, 0.02).count == 0);
}

TEST_CASE("a stem slips where PV shows it", "[estimator][slips]") {
  const effects::StictionParameters friction{1.6, 0.8};  // fs 1.2
  const auto stem_at = [&](std::size_t shown_at, double& penalty) {
    effects::StictionInertial law(friction, {20.0, 0.7}, 0.1, {0.0, 10.0});
    law.reset(0.0);
    std::vector<double> force;
    for (int k = 0; k < 200; ++k) force.push_back(0.01 * k);
    Slips slips;
    slips.direction.assign(200, 0);
    slips.coming.assign(200, 0);
    for (std::size_t k = shown_at - 30; k < shown_at; ++k) slips.coming[k] = 1;
    for (std::size_t k = shown_at; k < std::min<std::size_t>(shown_at + 5, 200); ++k) {
      slips.direction[k] = 1;
    }
    penalty = follow_slips(law, friction.static_friction(), slips, 0, force);
    std::size_t first = 0;
    while (first < force.size() && force[first] < 0.1) ++first;
    return first;
  };
  double penalty = 0.0;
  // The law's own moment is at sample 120.
  const std::size_t at_law = stem_at(120, penalty);
  CHECK(at_law >= 120);
  CHECK(at_law <= 124);
  CHECK(penalty < 0.1);
  const std::size_t early = stem_at(110, penalty);
  CHECK(early < at_law);
  CHECK(penalty == Approx(0.5 * std::pow(0.1 / (0.04 * 1.2), 2.0)).epsilon(0.2));
  const std::size_t late = stem_at(130, penalty);
  CHECK(late > at_law);
  CHECK(late <= 134);
  CHECK(penalty > 1.0);
  // Beyond what friction can vary it slips by itself, as it does where PV shows no jump at all.
  CHECK(stem_at(145, penalty) == Approx(138).margin(4));
  CHECK(stem_at(170, penalty) == Approx(at_law).margin(1));
}

}  // namespace slips_test
