// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/test_plan_file.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/text.hpp"
#include "daemon/protocol/planned_test/planned_test.hpp"

namespace loopwarden::protocol::test_plan_file_test {
namespace {

const std::string kPlan = R"(loop: "FIC-101"
configuration: "1a2b3c4d"
planned_at: "2026-11-29T00:21:24Z"
model: "model.yaml"
record: "next_test.record.csv"
without: ["learned"]
level_of_record: true
move: set_point_pair
from: 5  # PV units
size: 0.15  # PV units
hold: 60  # s
limits: {pv: [4.5, 5.5], co: [3, 6]}
expected: {probability_right: 0.96, probability_wrong: 0.01, pv_swing: 0.2, output_swing: 0.5}
explanations:
  - effects: ["stiction"]
    probability: 0.6
    pv: [[0, 4.9, 5.1], [60, 5, 5.2]]
  - effects: []
    probability: 0.4
)";

// The diagnostics of the plan with one part replaced.
std::string refusal_of(const std::string& part, const std::string& by) {
  const auto read = read_test_plan_text("next_test.yaml", tests::with(kPlan, part, by));
  CHECK_FALSE(read);
  return config::to_text(read.diagnostics);
}

}  // namespace

TEST_CASE("a plan is read and written back unchanged") {
  const auto plan = read_test_plan_text("next_test.yaml", kPlan);
  INFO(config::to_text(plan.diagnostics));
  REQUIRE(plan);
  CHECK(plan->loop == "FIC-101");
  CHECK(plan->configuration == 0x1a2b3c4dU);
  CHECK(plan->planned_at == 1795911684);
  CHECK(plan->move.size == 0.15);
  REQUIRE(plan->explanations.size() == 2);
  CHECK(plan->explanations[0].pv[1][2] == 5.2);
  CHECK(plan->explanations[1].effects.empty());
  CHECK(write_test_plan(*plan) == kPlan);
}

TEST_CASE("errors of a plan have file, line and key, with what is expected") {
  CHECK(refusal_of("hold: 60", "hodl: 60").find("unknown key 'hodl'; did you mean 'hold'?") !=
        std::string::npos);
  CHECK(refusal_of("set_point_pair", "set_point_pear").find("next_test.yaml:8:") == 0);
  CHECK(refusal_of("size: 0.15", "size: 0").find("size: must not be 0") != std::string::npos);
  CHECK(refusal_of("hold: 60", "hold: 4000").find("at most 3600 s") != std::string::npos);
  CHECK(refusal_of("[4.5, 5.5]", "[4.9, 5.5]").find("limits.pv: must contain from - size") !=
        std::string::npos);
  CHECK(refusal_of("1a2b3c4d", "1a2b3c4").find("eight hexadecimal digits") != std::string::npos);
  CHECK(refusal_of("24Z", "24").find("must be a UTC time") != std::string::npos);
  CHECK(refusal_of("[60, 5, 5.2]", "[60, 5]").find("each row needs") != std::string::npos);
  CHECK(refusal_of("  - effects: []\n    probability: 0.4\n", "").find("must be 2 to 3 (got 1)") !=
        std::string::npos);
}

TEST_CASE("a simulated test moves SP, or the output in manual, as planned") {
  TestPlanFile plan = *read_test_plan_text("next_test.yaml", kPlan);
  plant::LoopModel model;
  model.controller.pid.gains = {.kp = 0.35, .ki = 0.04};
  model.controller.pid.output_high = 10.0;
  model.process.gain = 1.2264;
  model.process.time_constant_s = 1.7;
  model.process.dead_time_s = 2.6;
  model.transmitter.high = 10.0;
  const TestRecord by_sp = simulate_test(model, plan);
  REQUIRE(by_sp.time_s.size() == by_sp.pv.size());
  CHECK(by_sp.time_s.front() < -50.0);
  CHECK(by_sp.time_s.back() == Approx(119.9));
  for (std::size_t k = 0; k < by_sp.sp.size(); ++k) {
    const bool moved = by_sp.time_s[k] > 0.05 && by_sp.time_s[k] < 59.95;
    if (moved) CHECK(by_sp.sp[k] == Approx(5.15));
    if (by_sp.time_s[k] < -0.05 || by_sp.time_s[k] > 60.05) CHECK(by_sp.sp[k] == 5.0);
  }
  plan.move.kind = estimator::MoveKind::output_pair;
  plan.from = 4.5;
  const TestRecord by_output = simulate_test(model, plan);
  const auto [low, high] = std::minmax_element(by_output.co.begin(), by_output.co.end());
  CHECK(*high - *low == Approx(0.15).margin(0.001));
}

}  // namespace loopwarden::protocol::test_plan_file_test
