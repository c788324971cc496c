// SPDX-License-Identifier: Apache-2.0
// Tests twins that are made from records, and refused records.
#include "model/twin/commission.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "model/twin/explain.hpp"
#include "model/twin/detectability.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/specialist/train/simulated_windows.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace commission_test {

using namespace loopwarden;
using twin::Outcome;

twin::Request request_of(const plant::LoopModel& truth) {
  return {.records = {test::record_of(truth, 260.0)}, .model = std::nullopt, .accept_short = true};
}

twin::Commissioning commissioned(const twin::Request& request) {
  return twin::commission(request, test::serial, [](double) {});
}

plant::LoopModel rough_model() {
  plant::LoopModel rough = test::believed_model();
  rough.process.gain *= 1.3;
  rough.process.time_constant_s *= 0.7;
  rough.process.dead_time_s *= 1.4;
  return rough;
}

TEST_CASE("a rough model becomes a twin that the record can't distinguish from the plant",
          "[commission][long]") {
  const plant::LoopModel truth = test::believed_model();
  twin::Request request = request_of(truth);
  request.model = rough_model();
  const twin::Commissioning made = commissioned(request);
  INFO(made.why);
  REQUIRE(made.outcome == Outcome::commissioned);
  CHECK(made.accepted == std::vector<std::string>{"short"});
  CHECK(made.effects.empty());
  CHECK(made.closed > 0.99);
  CHECK(made.twin.process.gain == Approx(truth.process.gain).epsilon(0.01));
  CHECK(made.twin.process.dead_time_s + made.twin.process.second_time_constant_s ==
        Approx(truth.process.dead_time_s).margin(0.1));
  CHECK(made.twin.transmitter.noise == Approx(0.015).epsilon(0.15));
  CHECK(made.twin.uncertainty == rough_model().uncertainty);
  REQUIRE(made.twin.scenario.set_point.size() == 6);
  CHECK(made.twin.scenario.set_point[1].first == Approx(10.0).margin(0.2));
  REQUIRE(made.twin.twin);
  REQUIRE(made.twin.twin->parameters.size() == 3);
  CHECK(made.twin.twin->covariance[0][0] < 1e-4);
  CHECK(made.twin.twin->largest > 0.0);
  REQUIRE(made.twin.twin->controller);
  CHECK(watch::ControllerWatch::can_watch(*made.twin.twin->controller, 10.0));
  CHECK(made.twin.twin->load);
  CHECK(made.stages.front().holdout_rmse > 10.0 * made.stages.back().holdout_rmse);
}

TEST_CASE("without a model one is identified", "[commission][long]") {
  twin::Request request = request_of(test::believed_model());
  request.ranges = {.pv = {{-1.0, 12.0}}, .co = {{0.0, 20.0}}};
  const twin::Commissioning made = commissioned(request);
  REQUIRE(made.outcome == Outcome::commissioned);
  CHECK(made.twin.transmitter.high == 12.0);
  CHECK(made.twin.controller.pid.output_high == 20.0);
  CHECK(made.identified);
  CHECK(made.twin.process.gain == Approx(1.1).epsilon(0.02));
  CHECK(made.twin.controller.pid.gains.kp == Approx(0.4).epsilon(0.1));
}

TEST_CASE("a valve fault is refused by name, and up to the limit it is the twin's",
          "[commission][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.3}}}};  // 3 % of span
  twin::Request request = request_of(truth);
  request.model = rough_model();
  const twin::Commissioning refused = commissioned(request);
  CHECK(refused.outcome == Outcome::not_healthy);
  INFO(refused.why);
  REQUIRE(!refused.effects.empty());
  CHECK(twin::size_percent(refused.effects[0].spec, 10.0) == Approx(3.0).margin(0.5));
  request.healthy_limit_percent = 5.0;
  const twin::Commissioning taken = commissioned(request);
  INFO(taken.why);
  REQUIRE(taken.outcome == Outcome::commissioned);
  REQUIRE(!taken.twin.valve_effects.empty());
  CHECK(twin::size_percent(taken.twin.valve_effects[0], 10.0) == Approx(3.0).margin(0.6));
}

TEST_CASE("records that can't make a twin report why, and the search does not start",
          "[commission]") {
  twin::Request request = request_of(test::believed_model());
  request.accept_short = false;
  CHECK(commissioned(request).outcome == Outcome::not_enough_movement);
  request.records[0].co.clear();
  CHECK(commissioned(request).outcome == Outcome::not_usable);
  request = request_of(test::believed_model());
  const std::size_t samples = request.records[0].size();
  request.records[0].sp.assign(samples, 4.0);
  CHECK(commissioned(request).outcome == Outcome::not_enough_movement);
  request = request_of(test::believed_model());
  request.records[0].automatic.assign(samples, 0.0);
  CHECK(commissioned(request).outcome == Outcome::not_usable);
  // A movement that is large within the recorded values can be small within a given range.
  request = request_of(test::believed_model());
  request.ranges.pv = {0.0, 1000.0};
  CHECK(commissioned(request).outcome == Outcome::not_enough_movement);
  request.ranges = {.pv = {}, .co = {{-1.0, 0.0}}};
  CHECK(commissioned(request).outcome == Outcome::not_usable);
}

// ---- watching the loop -------------------------------------------------------------------------

plant::LoopModel twin_model() {
  plant::LoopModel twin = test::believed_model();
  twin.transmitter.noise = 0.015;
  return twin;
}

// The healthy loop with faults that begin later.
numeric::LoopRecord changed_at(const std::vector<plant::ScheduledFault>& faults, double seconds,
                               double gain_factor = 1.0) {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= gain_factor;
  truth.scenario.faults = faults;
  numeric::LoopRecord record{.period_s = 0.1, .pv = {}, .sp = {}, .co = {}};
  truth.transmitter.noise = 0.015;
  truth.scenario.set_point = {{0.0, 4.0}};
  for (double t = 20.0; t < seconds; t += 40.0) {
    truth.scenario.set_point.emplace_back(t, std::fmod(t, 80.0) < 40.0 ? 5.5 : 4.0);
  }
  plant::SimulatedLoop loop(truth, 10.0 / 4096.0);
  for (double t = 0.0; t < seconds; t += 0.1) {
    const plant::LoopSample s = loop.step();
    record.pv.push_back(s.pv);
    record.sp.push_back(s.sp);
    record.co.push_back(s.co);
  }
  return record;
}

// s, when the condition is raised; 0: never.
double comes_on_s(const numeric::LoopRecord& record) {
  watch::TwinWatch watch(twin_model());
  for (std::size_t k = 0; k < record.size(); ++k) {
    watch.add(record.pv[k], record.co[k]);
    if (watch.on()) return record.seconds_at(k);
  }
  return 0.0;
}

plant::ScheduledFault gain_change(double factor) {
  return {.effect = {"gain_change", {{"factor", factor}}},
          .block = effects::Block::process,
          .schedule = {.from_s = 300.0}};
}

// An explanation of an alarm at `alarm_s`. Its stretch ends five minutes after it begins.
twin::Explanation explained(const numeric::LoopRecord& record, double alarm_s) {
  return twin::explain(record, twin_model(), static_cast<std::size_t>(alarm_s / 0.1),
                       {.enough_s = 300.0}, test::serial);
}

TEST_CASE(
    "the twin's watch is silent while the plant stays within its uncertainty, and on after that",
    "[commission][twin]") {
  CHECK(comes_on_s(changed_at({gain_change(1.0)}, 1200.0)) == 0.0);
  CHECK(comes_on_s(changed_at({gain_change(1.0)}, 1200.0, 1.02)) == 0.0);
  const double at_s = comes_on_s(changed_at({gain_change(1.4)}, 600.0));
  CHECK(at_s > 300.0);
  CHECK(at_s < 450.0);
}

TEST_CASE("neither an outlier nor a missing PV is a gap, and a gap in CO restarts the watch",
          "[commission][twin]") {
  numeric::LoopRecord record = changed_at({gain_change(1.0)}, 300.0);
  record.pv[1500] = 9.0;
  for (std::size_t k = 2000; k < 2100; ++k) record.pv[k] = std::nan("");
  CHECK(comes_on_s(record) == 0.0);
  watch::TwinWatch watch(twin_model());
  for (std::size_t k = 0; k < 1000; ++k) watch.add(record.pv[k], record.co[k]);
  watch.restart();
  bool on = false;
  for (std::size_t k = 0; k < 1000; ++k) {  // at once another operating point
    watch.add(record.pv[k] + 1.0, record.co[k]);
    on = on || watch.on();
  }
  CHECK(!on);
}

TEST_CASE("a condition raised before a restart clears if the loop is as commissioned",
          "[commission][twin]") {
  const numeric::LoopRecord record = changed_at({gain_change(1.0)}, 1100.0);
  watch::TwinWatch watch(twin_model());
  watch.restore(true);
  watch.add(record.pv[0], record.co[0]);
  CHECK(watch.on());
  for (std::size_t k = 1; k < record.size(); ++k) watch.add(record.pv[k], record.co[k]);
  CHECK(!watch.on());
}

TEST_CASE(
    "an explanation examines the data after the change, names it, and gives the alarm its name",
    "[commission][explain][long]") {
  const numeric::LoopRecord record = changed_at({gain_change(1.4)}, 900.0);
  constexpr double kAlarm_s = 450.0;
  const auto alarm = static_cast<std::size_t>(kAlarm_s / 0.1);
  const twin::TellingStretch telling = twin::telling_stretch(record, twin_model(), alarm, {});
  const gap::SampleRange stretch = telling.range;
  CHECK(telling.latest >= stretch.begin);
  CHECK(record.seconds_at(stretch.begin) == Approx(300.0).margin(45.0));
  CHECK(stretch.end > alarm);
  const twin::Explanation e = explained(record, kAlarm_s);
  REQUIRE(e.usable());
  REQUIRE(e.result.effects.size() == 1);
  CHECK(e.result.effects[0].spec.name == "gain_change");
  using alarm::AlarmKind;
  CHECK(twin::agrees(e, AlarmKind::model_gap));
  CHECK(!twin::agrees(e, AlarmKind::stiction));
  CHECK(!twin::final_name(e, AlarmKind::model_gap));

  twin::Explanation other = e;
  other.closed = 0.99;
  other.result.effects[0].confidence = 0.95;
  const twin::Explanation sure = other;
  CHECK(twin::final_name(sure, AlarmKind::stiction) == AlarmKind::model_gap);
  other.closed = 0.7;
  CHECK(!twin::final_name(other, AlarmKind::stiction));
  other = sure;
  other.result.effects[0].confidence = 0.85;
  CHECK(!twin::final_name(other, AlarmKind::stiction));
  other = sure;
  other.result.effects[0].spec = {"backlash", {{"deadband", 0.4}}};
  other.result.effects[0].block = effects::Block::valve;
  CHECK(twin::final_name(other, AlarmKind::stiction) == AlarmKind::backlash);
  CHECK(twin::size_percent(other) == Approx(4.0));
  CHECK(!twin::final_name(other, AlarmKind::hysteresis));
  other.result.effects[0].spec = {"leakage", {{"flow", 0.4}}};
  CHECK(twin::final_name(other, AlarmKind::stiction) == AlarmKind::unknown);
}

TEST_CASE("two changes at once are both named", "[commission][explain][long]") {
  const plant::ScheduledFault backlash{.effect = {"backlash", {{"deadband", 0.5}}},
                                       .block = effects::Block::valve,
                                       .schedule = {.from_s = 300.0}};
  const numeric::LoopRecord record = changed_at({gain_change(0.75), backlash}, 600.0);
  const twin::Explanation e = explained(record, 400.0);
  REQUIRE(e.result.effects.size() == 2);
  for (const gap::FoundEffect& effect : e.result.effects) {
    CAPTURE(effect.spec.name);
    if (effect.spec.name == "gain_change") {
      CHECK(effect.spec.parameters.at("factor") == Approx(0.75).epsilon(0.05));
      continue;
    }
    // A small hysteresis or creep is nearly the same band.
    CHECK((effect.spec.name == "backlash" || effect.spec.name == "hysteresis" ||
           effect.spec.name == "creep"));
    CHECK(effect.block == effects::Block::valve);
  }
  CHECK(record.seconds_at(e.at) == Approx(300.0).margin(45.0));
}

TEST_CASE("a change that no effect explains gets no name", "[commission][explain][long]") {
  numeric::LoopRecord record = changed_at({gain_change(1.0)}, 600.0);
  // A sine that becomes faster.
  for (std::size_t k = 3000; k < record.size(); ++k) {
    const double t = record.seconds_at(k) - 300.0;
    record.pv[k] += 0.4 * std::sin((0.05 + 0.001 * t) * t);
  }
  const twin::Explanation e = explained(record, 400.0);
  REQUIRE(e.usable());
  CHECK(e.result.outcome == gap::Outcome::unexplained);
  CHECK(e.result.effects.empty());
  CHECK(!twin::final_name(e, alarm::AlarmKind::stiction));
  CHECK(e.result.sentence == "The loop differs from its twin, and no effect explains how.");
}

TEST_CASE("a change of the controller is not named in a loop that the daemon controls",
          "[commission][explain][long]") {
  plant::LoopModel other = test::believed_model();
  other.controller.pid.gains.kp *= 2.0;
  const numeric::LoopRecord record = test::record_of(other, 240.0);
  const auto controller_named = [&](bool judged) {
    const twin::Explanation e = twin::explain(record, test::believed_model(), record.size() - 1,
                                              {.judge_controller = judged}, test::serial);
    const auto& effects = e.result.effects;
    return std::any_of(effects.begin(), effects.end(),
                       [](const auto& one) { return one.block == effects::Block::controller; });
  };
  CHECK(controller_named(true));
  CHECK_FALSE(controller_named(false));
}

TEST_CASE("windows of a twin have its noise and the set-point moves of its scenario",
          "[commission][training]") {
  plant::LoopModel twin = twin_model();
  twin.scenario.set_point = {{0.0, 4.0}, {100.0, 4.5}, {300.0, 4.2}};
  twin.scenario.duration_s = 500.0;
  twin.twin = plant::TwinFit{{"gain"}, {{1e-4}}};
  for (std::uint64_t seed = 1; seed < 12; ++seed) {
    const specialist::SimulatedWindow window = specialist::simulate_window(
        twin,
        {.condition = specialist::Condition::no_fault, .moves = specialist::SetPointMoves::own},
        seed);
    const auto moved =
        std::adjacent_find(window.sp.begin(), window.sp.end(), std::not_equal_to<>());
    REQUIRE(moved != window.sp.end());
    for (const double sp : window.sp) CHECK((sp == 4.0 || sp == 4.5 || sp == 4.2));
  }
}

TEST_CASE("outside the range of the healthy record, the twin's watch does not judge",
          "[commission][twin]") {
  const numeric::LoopRecord changed = changed_at({gain_change(1.4)}, 600.0);
  plant::LoopModel twin = twin_model();
  const auto on = [&] {
    watch::TwinWatch watch(twin);
    for (std::size_t k = 0; k < changed.size(); ++k) watch.add(changed.pv[k], changed.co[k]);
    return watch.on();
  };
  if (!twin.twin) twin.twin.emplace();
  twin.twin->seen_low = 3.0;
  twin.twin->seen_high = 7.0;
  CHECK(on());
  twin.twin->seen_low = 6.5;
  CHECK_FALSE(on());
}

TEST_CASE("a watch that begins in the middle of a move takes it for no change",
          "[commission][twin]") {
  const numeric::LoopRecord record = changed_at({gain_change(1.0)}, 600.0);
  const plant::LoopModel twin = twin_model();
  for (std::size_t begin = 190; begin < 260; begin += 10) {  // SP moves at 20 s
    watch::TwinWatch watch(twin);
    bool on = false;
    for (std::size_t k = begin; k < record.size(); ++k) {
      watch.add(record.pv[k], record.co[k]);
      on = on || watch.on();
    }
    INFO("from sample " << begin);
    CHECK_FALSE(on);
  }
}

TEST_CASE("a few missing cycles don't restart the watch", "[commission][twin]") {
  const numeric::LoopRecord record = changed_at({gain_change(1.4)}, 600.0);
  const plant::LoopModel twin = twin_model();
  watch::LoopMonitor watched({.sample_time_s = 0.1, .pv_high = 10.0, .co_high = 10.0}, {}, nullptr,
                             &twin);
  double at_s = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (k % 37 == 0) continue;
    const watch::MonitorStep step = watched.add({.period_index = k,
                                                 .sp = record.sp[k],
                                                 .pv = record.pv[k],
                                                 .co = record.co[k],
                                                 .automatic = true,
                                                 .pv_good = true});
    if (step.twin && at_s == 0.0) at_s = record.seconds_at(k);
  }
  CHECK(at_s > 300.0);
  CHECK(at_s < 450.0);
}

}  // namespace commission_test
