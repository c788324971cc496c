// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/judge_test.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "model/effects/catalogue.hpp"
#include "tests/model/estimator/estimator_support.hpp"

namespace judge_test_test {

using namespace loopwarden;
using namespace loopwarden::estimator;

namespace {

// A valve that moves all the time.
Observed record(const plant::LoopModel& truth, std::size_t samples, std::uint64_t seed) {
  return estimator_test::record_of(truth, estimator_test::moving_output(samples, seed), seed);
}

}  // namespace

TEST_CASE("two records are joined with PV missing between them", "[estimator][judge_test]") {
  const plant::LoopModel model = estimator_test::believed_model();
  const Observed first = record(model, 100, 3);
  const Observed test = record(model, 50, 4);
  const Observed both = joined(first, test, 2.0);
  REQUIRE(both.pv.size() == 170);
  REQUIRE(both.co.size() == 170);
  CHECK(std::count(both.used.begin(), both.used.end(), false) == 20);
  CHECK_FALSE(both.used[100]);
  CHECK(both.used[120]);
  CHECK(both.pv[120] == test.pv[0]);
  const auto [low, high] = std::minmax(first.co.back(), test.co.front());
  for (std::size_t k = 100; k < 120; ++k) CHECK((both.co[k] >= low && both.co[k] <= high));
}

TEST_CASE("a test that moves the valve decides what a quiet record left open",
          "[estimator][judge_test]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.valve_effects = {{"backlash", {{"deadband", 0.6}}}};
  Options options;
  for (const effects::Descriptor& effect : effects::effect_catalogue()) {
    const std::string name = effect.name;
    if (name != "backlash" && name != "gain_change") options.without.push_back(name);
  }
  // One way only: play hides until the output turns.
  std::vector<double> one_way;
  for (std::size_t k = 0; k < 900; ++k) {
    one_way.push_back(3.0 + 0.001 * static_cast<double>(k));
  }
  const Observed quiet = estimator_test::record_of(truth, one_way);
  const std::vector<std::vector<std::string>> names{{}, {"backlash"}};
  const Judged judged =
      judge_test(names, quiet, record(truth, 900, 5), model, options, estimator_test::in_order);
  REQUIRE(judged.probability.size() == 2);
  CHECK(judged.probability[0] + judged.probability[1] + judged.other == Approx(1.0));
  CHECK(judged.decided == 1);
}

}  // namespace judge_test_test
