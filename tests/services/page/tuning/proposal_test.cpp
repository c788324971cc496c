// SPDX-License-Identifier: Apache-2.0
#include "services/page/tuning/proposal.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <fmt/format.h>

#include "tests/services/page/tuning/recorded_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::proposal_test {
namespace {

using namespace loopwarden::page::tuning;

const LoopFacts kFacts{.sample_time_s = 0.5,
                       .pv_range = {0.0, 100.0},
                       .output_limits = {0.0, 100.0},
                       .gains = {.kp = 0.5, .ki = 0.05}};

StepRecord recorded(const plant::LoopModel& model) {
  const TemporaryFolder folder;
  page::history::History history;
  record_run(folder.path(), model, 600.0);
  return newest_step(
             history, folder.path(),
             {.sample_time_s = 0.5, .integral_time_s = 10.0, .now_ms = kRecordStart_ms + 600'000})
      .value();
}

TEST_CASE("the process of a recorded step is identified, and rules are tried on it") {
  const Identified found =
      identified(recorded(recorded_plant({{0.0, 40.0}, {200.0, 60.0}})), kFacts);
  REQUIRE(found.model);
  CHECK(found.model->process.gain == Approx(1.5).epsilon(0.1));
  CHECK(found.model->process.dead_time_s == Approx(3.0).margin(0.6));
  CHECK(found.gain[0] < found.gain[1]);
  CHECK(found.fit_percent > 80.0);
  const Proposal proposal = propose(*found.model, kFacts, analysis::ControllerForm::pi);
  REQUIRE(proposal.recommended);
  const analysis::RuleTrial& today = proposal.trials.front();
  const analysis::RuleTrial& best = proposal.trials.at(*proposal.recommended);
  CHECK(today.gains == kFacts.gains);
  CHECK(best.response.load_absolute_error < today.response.load_absolute_error);
  CHECK(best.response.settles);
  // The gain that is set is the gain that is shown.
  CHECK(best.gains.kp == std::stod(fmt::format("{:.4g}", best.gains.kp)));
}

TEST_CASE("if the record can't identify the loop, the reason is given") {
  plant::LoopModel still = recorded_plant({{0.0, 40.0}, {200.0, 42.0}});
  still.transmitter.noise = 5.0;
  const Identified found = identified(recorded(still), kFacts);
  CHECK_FALSE(found.model);
  CHECK_FALSE(found.why_not.empty());
}

TEST_CASE("a model is simulated within the loop's own ranges, with any disturbance") {
  plant::LoopModel twin = recorded_plant({});
  twin.process.gain = -0.2;  // without a disturbance CO would be far out of its limits at mid range
  twin.transmitter_effects = {{"output_bias", {{"bias", 3.0}}}};
  const plant::LoopModel model = model_of(twin, kFacts);
  CHECK(model.process.gain == -0.2);
  const Proposal proposal = propose(model, kFacts, analysis::ControllerForm::pi);
  const analysis::SimulatedRecord& answer = proposal.trials.front().response.record;
  CHECK(answer.pv.front() == Approx(50.0));
  CHECK(answer.co.front() == Approx(50.0).margin(1.0));
  CHECK(answer.co[200] < 50.0);  // the set point rises, so CO falls
}

TEST_CASE("a slow process takes no more computing time than a quick one") {
  plant::LoopModel twin = recorded_plant({});
  twin.process.time_constant_s = 1e5;
  const Proposal proposal = propose(model_of(twin, kFacts), kFacts, analysis::ControllerForm::pi);
  CHECK(proposal.trials.front().response.record.pv.size() < 41'000);
}

}  // namespace
}  // namespace loopwarden::tests::proposal_test
