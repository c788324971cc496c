// SPDX-License-Identifier: Apache-2.0
// Tests the statements that are allowed about a record of which an archive kept a part only.
#include "model/gap/workflow.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "model/analysis/archive.hpp"
#include "tests/model/gap/few_names.hpp"
#include "tests/model/gap/gap_support.hpp"
#include "tests/support/archive.hpp"

namespace loopwarden::tests::archived_test {
namespace {

numeric::LoopRecord thinned(numeric::LoopRecord record, double pv, double co) {
  record.pv = lines_between(record.pv, by_swinging_door(record.pv, pv));
  record.co = lines_between(record.co, by_swinging_door(record.co, co));
  return record;
}

gap::Result find(const numeric::LoopRecord& record, const gap::Deviations& deviations) {
  return gap::find_gap(record, test::believed_model(), {.archive = deviations}, test::serial,
                       [](double) {});
}

gap::Result find_among(const std::vector<std::string>& names, const numeric::LoopRecord& record,
                       const gap::Deviations& deviations) {
  gap::Options options = test::options_among(names);
  options.archive = deviations;
  return gap::find_gap(record, test::believed_model(), options, test::serial, [](double) {});
}

}  // namespace

TEST_CASE("a stick wider than the archive's deviation gets no other name, a narrower one no name",
          "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"stiction", {{"s", 1.0}, {"j", 0.5}}}};
  const numeric::LoopRecord record = thinned(test::record_of(truth, 130.0), 0.05, 0.05);
  const gap::Result seen = find(record, {.pv = 0.05, .co = 0.05});
  CHECK(seen.outcome != gap::Outcome::no_gap);
  for (const gap::FoundEffect& effect : seen.effects) {
    CHECK(effect.spec.name == "stiction");
    CHECK(effect.confidence <= 0.85);
  }

  // The same record from an archive with a deviation of up to 0.7. Every band is too narrow.
  const std::vector<std::string> bands{"stiction", "backlash", "hysteresis", "resolution"};
  const gap::Result hidden = find_among(bands, record, {.pv = 0.7, .co = 0.7});
  CHECK(hidden.outcome != gap::Outcome::missing_effect);
  CHECK(hidden.corrected == test::believed_model());

  // The deviation of CO is unknown: the gap exists, but has no name.
  const gap::Result unknown = find_among(bands, record, {.pv = 0.05, .co = 0.0, .known = false});
  REQUIRE(unknown.outcome == gap::Outcome::unexplained);
  CHECK(unknown.effects.empty());
  CHECK(unknown.corrected == test::believed_model());
  REQUIRE(unknown.remainder);
  CHECK(unknown.remainder->looks_like == gap::LooksLike::compression);
}

TEST_CASE("in a thinned record a controller is never reported as a different one", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.controller.pid.gains.kp *= 2.0;
  const gap::Result result =
      find(thinned(test::record_of(truth, 130.0), 0.05, 0.05), {.pv = 0.05, .co = 0.05});
  CHECK(result.effects.empty());
  CHECK(result.corrected.controller == test::believed_model().controller);
}

}  // namespace loopwarden::tests::archived_test
