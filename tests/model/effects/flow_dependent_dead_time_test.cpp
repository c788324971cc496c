// SPDX-License-Identifier: Apache-2.0
#include "model/effects/flow_dependent_dead_time/flow_dependent_dead_time.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "model/effects/extra_dead_time/extra_dead_time.hpp"
#include "tests/model/effects/search_support.hpp"

namespace flow_dependent_dead_time_test {

using namespace loopwarden;

// Returns the samples from a small step at `flow` until half of it has come out.
double late_by(effects::FlowDependentDeadTime& pipe, double flow) {
  pipe.reset(flow);
  for (int k = 1; k < 5000; ++k) {
    if (pipe.step(1.0001 * flow) > 1.00005 * flow) return k - 1;
  }
  return -1.0;
}

TEST_CASE("at rest the dead time is the flow to the power of minus exponent",
          "[effects][flow_dependent_dead_time]") {
  for (const double exponent : {0.5, 1.0, 2.0}) {
    effects::FlowDependentDeadTime pipe(2.0, exponent, 4.0, 0.01);
    CHECK(late_by(pipe, 4.0) == Approx(200.0).margin(1.5));
    CHECK(late_by(pipe, 8.0) == Approx(200.0 * std::pow(0.5, exponent)).margin(1.5));
    CHECK(late_by(pipe, 2.0) == Approx(200.0 * std::pow(2.0, exponent)).margin(1.5));
  }
}

TEST_CASE("a plug leaves the pipe one volume after it entered",
          "[effects][flow_dependent_dead_time]") {
  effects::FlowDependentDeadTime pipe(1.5, 1.0, 5.0, 0.01);
  std::vector<double> flow{5.0};
  pipe.reset(5.0);
  for (int k = 1; k < 3000; ++k) {
    flow.push_back(5.0 + 2.0 * std::sin(0.004 * k));
    const double out = pipe.step(flow.back());
    double volume = 0.0;  // that entered after the plug that leaves
    std::size_t plug = flow.size() - 1;
    while (plug > 0 && volume < 1.5 * 5.0) volume += 0.01 * flow[--plug];
    if (plug == 0) continue;
    REQUIRE(out == Approx(flow[plug]).margin(0.02));
  }
}

TEST_CASE("without an exponent it is a dead time, and severity takes the exponent away",
          "[effects][flow_dependent_dead_time]") {
  effects::FlowDependentDeadTime none(0.77, 0.0, 5.0, 0.1);
  effects::FlowDependentDeadTime faded(0.77, 1.0, 5.0, 0.1);
  faded.set_severity(0.0);
  effects::ExtraDeadTime plain(0.77, 0.1);
  none.reset(3.0);
  faded.reset(3.0);
  plain.reset(3.0);
  for (int k = 0; k < 400; ++k) {
    const double u = 3.0 + std::sin(0.3 * k);
    const double out = plain.step(u);
    REQUIRE(none.step(u) == Approx(out));
    REQUIRE(faded.step(u) == Approx(out));
  }
}

TEST_CASE("no flow ends the growth at ten times", "[effects][flow_dependent_dead_time]") {
  effects::FlowDependentDeadTime pipe(1.0, 1.0, 5.0, 0.1);
  pipe.reset(5.0);
  for (int k = 0; k < 300; ++k) pipe.step(0.0);
  int late = 0;
  while (pipe.step(5.0) < 2.5 && late < 1000) ++late;
  CHECK(late > 0);
  CHECK(late <= 100);
}

TEST_CASE("it replaces the process's dead time", "[effects][flow_dependent_dead_time]") {
  plant::LoopModel model = test::believed_model();
  plant::LoopModel with = model;
  with.process_effects = {{"flow_dependent_dead_time", {{"exponent", 0.0}}}};
  plant::LoopModel scheduled = model;
  scheduled.scenario.faults = {{{"flow_dependent_dead_time", {{"exponent", 0.0}}},
                                effects::Block::process,
                                {.from_s = 5.0}}};
  plant::Plant plain(model, 1);
  plant::Plant same(with, 1);
  plant::Plant later(scheduled, 1);
  for (plant::Plant* plant : {&plain, &same, &later}) plant->reset(3.0);
  for (int k = 0; k < 200; ++k) {
    const double co = k < 20 ? 3.0 : 5.0;
    const double pv = plain.step(co);
    REQUIRE(same.step(co) == Approx(pv));
    REQUIRE(later.step(co) == Approx(pv));
  }
}

TEST_CASE("a dead time that follows the flow is found, and a constant one keeps its name",
          "[effects][flow_dependent_dead_time]") {
  const std::vector<std::string> names{"flow_dependent_dead_time", "extra_dead_time", "extra_lag"};
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"flow_dependent_dead_time", {{"exponent", 1.0}, {"nominal", 5.0}}}};
  const test::Named named = test::named_among(names, truth);
  CHECK(named.first == "flow_dependent_dead_time");
  CHECK(named.lead_nats > 6.0);
  REQUIRE(named.corrected.process_effects.size() == 1);
  CHECK(named.corrected.process_effects[0].parameters.at("exponent") == Approx(1.0).epsilon(0.15));
  truth.process_effects = {{"extra_dead_time", {{"seconds", 0.9}}}};
  CHECK(test::named_among(names, truth).first == "extra_dead_time");
}

}  // namespace flow_dependent_dead_time_test
