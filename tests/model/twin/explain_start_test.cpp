// SPDX-License-Identifier: Apache-2.0
// An explanation of minutes that begin with PV outside the range in which the twin may judge.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "model/twin/commission.hpp"
#include "model/twin/explain.hpp"
#include "model/control/loop_controller.hpp"
#include "model/alarm/given_name.hpp"
#include "model/watch/twin_watch.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace explain_start_test {

using namespace loopwarden;

namespace {

constexpr double kPeriod_s = 0.5;

plant::LoopModel healthy_loop() {
  plant::LoopModel m;
  m.sample_time_s = kPeriod_s;
  m.controller.pid.gains = {.kp = 1.0, .ki = 0.2};
  m.process = {.gain = 0.25, .time_constant_s = 4.0, .dead_time_s = 1.5};
  m.transmitter = {.low = 0.0, .high = 25.0, .noise = 0.02};
  m.controller.set_point = {.low = 0.0, .high = 25.0};
  m.disturbances = {
      {.name = "random_load", .parameters = {{"intensity", 0.015}, {"time_constant", 40.0}}}};
  return m;
}

double set_point_at(double time_s) {
  const int part = static_cast<int>(time_s / 120.0) % 4;
  return part == 0 ? 12.0 : part == 1 ? 13.0 : part == 2 ? 12.0 : 11.2;
}

// The valve sticks from `sticks_s` on. The stem begins at `stem`, CO units; CO begins at 48.
numeric::LoopRecord run(double seconds, double stem, double sticks_s, std::uint64_t seed) {
  constexpr double co = 48.0;
  plant::LoopModel m = healthy_loop();
  m.scenario.faults = {{.effect = {.name = "stiction", .parameters = {{"s", 4.2}, {"j", 1.8}}},
                        .block = effects::Block::valve,
                        .schedule = {.from_s = sticks_s}}};
  plant::Plant plant(m, seed);
  plant.reset(stem);
  control::LoopController controller(m.controller, kPeriod_s, 12.0, co);
  controller.assume_output(co);
  controller.request_mode(control::Mode::automatic);
  numeric::LoopRecord record{.period_s = kPeriod_s, .pv = {}, .sp = {}, .co = {}};
  for (double t = 0.0; t < seconds; t += kPeriod_s) {
    controller.request_set_point(set_point_at(t));
    const double pv = plant.process_variable();
    const control::ControllerOutput out = controller.step({.process_variable = pv});
    record.pv.push_back(pv);
    record.sp.push_back(out.set_point);
    record.co.push_back(out.output);
    plant.step(out.output);
  }
  return record;
}

}  // namespace

TEST_CASE("minutes that begin at PV 0 are explained by the events after that",
          "[commission][explain][long]") {
  constexpr std::uint64_t seed = 3;
  plant::LoopModel believed = healthy_loop();
  believed.disturbances.clear();
  const twin::Commissioning made =
      twin::commission({.records = {run(1300.0, 48.0, 1e9, seed + 20)}, .model = believed},
                       test::serial, [](double) {});
  INFO(made.why);
  REQUIRE(made.outcome == twin::Outcome::commissioned);

  const numeric::LoopRecord record = run(760.0, 0.0, 60.0, seed);
  watch::TwinWatch watch(made.twin);
  std::size_t alarm = 0;
  while (alarm + 1 < record.size() && !watch.on()) {
    watch.add(record.pv[alarm], record.co[alarm]);
    ++alarm;
  }
  REQUIRE(watch.on());
  const twin::Explanation e =
      twin::explain(record, made.twin, alarm, {.judge_controller = false}, test::serial);
  const double first_s = kPeriod_s * static_cast<double>(e.stretch.begin);
  CHECK(first_s > 5.0);
  if (e.usable() && !e.result.effects.empty()) {
    CHECK(e.result.effects.front().spec.name == "stiction");
  }
}

TEST_CASE("one rule decides whether an explanation gives an alarm and its incident a name",
          "[monitor][incident]") {
  using alarm::gives_name;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  CHECK(gives_name("gain_change", 0.9, 0.95, false));
  CHECK(gives_name("gain_change", 0.9, kUnknown, false));
  CHECK_FALSE(gives_name("gain_change", 0.89, 0.95, false));
  CHECK_FALSE(gives_name("gain_change", kUnknown, 0.95, false));
  CHECK_FALSE(gives_name("gain_change", 0.94, 0.79, false));
  CHECK_FALSE(gives_name("", 0.94, 0.95, false));
  CHECK(gives_name("learned", 0.94, 0.95, false));
  // The read-back shows that the stem sticks.
  CHECK_FALSE(gives_name("learned", 0.94, 0.95, true));
  CHECK(gives_name("stiction", 0.94, 0.95, true));
}

}  // namespace explain_start_test
