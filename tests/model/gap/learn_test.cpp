// SPDX-License-Identifier: Apache-2.0
// Tests the law that is learned for a plant that no name fits, with the whole workflow and without
// the names.
#include "model/gap/learn.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace learn_test {

using namespace loopwarden;

// Searches for no name, so that only a learned law can explain the record.
gap::Result nameless(const numeric::LoopRecord& record, bool learns = true) {
  gap::Options options;
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (!learns || std::string_view(info.name) != "learned")
      options.search.without.emplace_back(info.name);
  }
  return gap::find_gap(record, test::believed_model(), options, test::serial, [](double) {});
}

std::string form_of(const gap::Result& result) {
  if (result.effects.size() != 1 || result.effects[0].spec.name != "learned") return "none";
  return result.effects[0].spec.options.at("form");
}

TEST_CASE("a characteristic is learned as a curve of the flow", "[gap][learn]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"valve_characteristic", {}, {{"curve", "quick_opening"}}}};
  const gap::Result result = nameless(test::record_of(truth, 200.0));
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  CHECK(form_of(result) == "static");
  CHECK(result.effects[0].block == effects::Block::valve);
  CHECK(result.after.holdout_rmse < 0.3 * result.before.holdout_rmse);
  CHECK(result.effects[0].confidence < 0.9);
  REQUIRE(result.corrected.valve_effects.size() == 1);
  CHECK(result.corrected.valve_effects[0] == result.effects[0].spec);
  CHECK(result.sentence.find("No effect of the catalogue fits") == 0);
}

TEST_CASE("play is learned as plays, and a slow tail as lags", "[gap][learn]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
  CHECK(form_of(nameless(test::record_of(truth, 200.0))) == "hysteretic");
  truth.valve_effects.clear();
  // 0.7 at once and 0.3 through 15 s: (1 + 10.5 p)/(1 + 15 p).
  truth.process_effects = {{"learned", {}, {{"form", "dynamic"}}, {{1.0, 1.0}, {10.5, 15.0}}}};
  const gap::Result tail = nameless(test::record_of(truth, 200.0));
  CHECK(form_of(tail) == "dynamic");
  CHECK(tail.after.holdout_rmse < 0.4 * tail.before.holdout_rmse);
}

TEST_CASE("a disturbance of no form is not learned", "[gap][learn]") {
  const plant::LoopModel truth = test::believed_model();
  numeric::LoopRecord record = test::record_of(truth, 200.0);
  numeric::Random random(8);
  double level = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (random.uniform() < 0.01) level = 0.4 * random.normal();
    record.pv[k] += level;
  }
  const gap::Result result = nameless(record);
  CHECK(result.outcome == gap::Outcome::unexplained);
  CHECK(result.effects.empty());
  CHECK(result.corrected == test::believed_model());
}

TEST_CASE("no law is learned if the model is complete", "[gap][learn]") {
  CHECK(nameless(test::record_of(test::believed_model(), 200.0)).outcome == gap::Outcome::no_gap);
}

TEST_CASE("a name that is left out is not given, and learning can be left out", "[gap][learn]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
  const gap::Result result = nameless(test::record_of(truth, 200.0), false);
  CHECK(result.outcome == gap::Outcome::unexplained);
  CHECK(result.candidates.empty());
}

TEST_CASE("a law outperforms names by a fifth of the gap, in all or on two blocks of three",
          "[gap][learn]") {
  // Six blocks of ten samples; the model leaves 1 in each.
  gap::Learned law;
  for (std::size_t b = 0; b < 6; ++b) {
    law.blocks.push_back(
        {.range = {10 * b, 10 * b + 10}, .samples = 10.0, .model = 10.0, .learned = 1.0});
  }
  const std::vector<bool> counts(60, true);
  // Squared error of names that leave `square` in the first `blocks`, and as much as the law in the
  // others.
  const auto left = [](std::size_t blocks, double square) {
    std::vector<double> out(60, std::sqrt(0.1));
    std::fill(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(10 * blocks),
              std::sqrt(square));
    return out;
  };
  CHECK(gap::ousts(law, left(6, 0.301), counts, 0.0));
  CHECK_FALSE(gap::ousts(law, left(6, 0.299), counts, 0.0));
  CHECK(gap::ousts(law, left(4, 0.301), counts, 0.0));
  CHECK_FALSE(gap::ousts(law, left(3, 0.301), counts, 0.0));
  // so much in one block that it is a fifth in all
  CHECK(gap::ousts(law, left(1, 1.4), counts, 0.0));
  // Blocks without a gap don't count.
  CHECK_FALSE(gap::ousts(law, left(6, 0.301), counts, 0.6));
  CHECK_FALSE(gap::ousts(law, left(6, 0.301), std::vector<bool>(60, false), 0.0));
}

}  // namespace learn_test
