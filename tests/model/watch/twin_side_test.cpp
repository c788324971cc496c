// SPDX-License-Identifier: Apache-2.0
// Tests the twin's controller and load watches of a loop.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "model/watch/controller_watch.hpp"
#include "model/watch/load_watch.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/plant/plant.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace twin_side_test {

using namespace loopwarden;
using watch::ControllerWatch;
using watch::LoadWatch;
using watch::TwinChange;
using watch::TwinWatch;

constexpr double kResolution = 10.0 / 4096.0;

plant::LoopModel twin_model() {
  plant::LoopModel twin = test::believed_model();
  twin.transmitter.noise = 0.015;
  twin.twin.emplace();
  twin.twin->seen_low = 1.0;
  twin.twin->seen_high = 9.0;
  twin.twin->load = plant::SeenLoad{.mean = 0.0, .deviation = 0.01, .step = 0.02};
  twin.twin->controller = plant::SeenController{.rms = 0.001, .resolution = kResolution};
  return twin;
}

struct Side {
  double controller_s = 0.0;  // when the condition is raised; 0: never
  double change_s = 0.0;
  double load_s = 0.0;
  // model_gap of a loop with another controller, and of a loop that this daemon controls; 0: never.
  double foreign_gap_s = 0.0;
  double own_gap_s = 0.0;
  double load_size = 0.0;
  TwinChange leading = TwinChange::gain;
  std::array<double, watch::kTwinChanges> untested_s{};
  watch::TwinRemarks foreign;  // at the end
  watch::TwinRemarks own;
};

struct Change {
  double at_s = 300.0;
  control::PidSettings pid = test::believed_model().controller.pid;
  plant::LoopModel plant = test::believed_model();
  std::function<double(double)> load = [](double) { return 0.0; };
  double sp_move = 1.0;  // PV units
};

// Runs a loop for 20 minutes with a move of SP every two minutes.
Side beside(const Change& change, const plant::LoopModel& twin = twin_model()) {
  plant::LoopModel healthy = test::believed_model();
  plant::Plant before(healthy, 1);
  plant::Plant after(change.plant, 1);
  control::Pid law(healthy.controller.pid, healthy.sample_time_s);
  ControllerWatch controller(twin);
  TwinWatch watch(twin);
  LoadWatch load(twin);
  const watch::WindowSettings window{.sample_time_s = healthy.sample_time_s, .routine = false};
  watch::LoopMonitor foreign(window, alarm::kAlarmRule, nullptr, &twin, true);
  watch::LoopMonitor own(window, alarm::kAlarmRule, nullptr, &twin, false);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.015);
  const double start = before.output_for(5.0);
  before.reset(start);
  after.reset(start);
  law.initialise(start, 5.0, 5.0);
  double co = start;
  bool retuned = false;
  Side out;
  for (std::size_t k = 0; k < 12000; ++k) {
    const double t = healthy.sample_time_s * static_cast<double>(k);
    const double sp = std::fmod(t, 240.0) < 120.0 ? 5.0 : 5.0 + change.sp_move;
    const bool changed = t >= change.at_s;
    const double flow = changed ? after.process_variable() : before.process_variable();
    const double pv =
        std::round((flow + change.load(t) + noise(random)) / kResolution) * kResolution;
    if (changed && !retuned) {
      law.configure(change.pid);
      retuned = true;
    }
    const control::PidSettings& s = law.settings();
    const double u = law.step(sp, pv, co, 0.0);
    co = std::round(std::clamp(u, s.output_low, s.output_high) / kResolution) * kResolution;
    before.step(co);
    after.step(co);
    controller.add(sp, pv, co);
    watch.add(pv, co);
    if (watch.load_known()) load.add(watch.load());
    const auto gap_of = [&](watch::LoopMonitor& loop, double& first_s) {
      const watch::MonitorStep step = loop.add(
          {.period_index = k, .sp = sp, .pv = pv, .co = co, .automatic = true, .pv_good = true});
      const bool gap =
          step.twin && step.conditions[alarm::index_of(alarm::AlarmKind::model_gap)].on;
      if (gap && first_s == 0.0) first_s = t;
    };
    gap_of(foreign, out.foreign_gap_s);
    gap_of(own, out.own_gap_s);
    if (controller.on() && out.controller_s == 0.0) out.controller_s = t;
    if (watch.on() && out.change_s == 0.0) {
      out.change_s = t;
      out.leading = watch.leading();
    }
    if (load.outside() && out.load_s == 0.0) out.load_s = t;
    if (load.outside()) out.load_size = load.outside()->size;
  }
  for (std::size_t i = 0; i < watch::kTwinChanges; ++i) {
    out.untested_s[i] = watch.untested_s(static_cast<TwinChange>(i));
  }
  out.foreign = foreign.remarks().value();
  out.own = own.remarks().value();
  return out;
}

TEST_CASE("a loop that is as commissioned raises no condition", "[twin]") {
  const Side side = beside({});
  CHECK(side.controller_s == 0.0);
  CHECK(side.change_s == 0.0);
  CHECK(side.load_s == 0.0);
}

TEST_CASE("a controller that was retuned or limited is seen, and only there", "[twin]") {
  Change retuned;
  retuned.pid.gains.kp *= 0.6;
  retuned.pid.gains.ki *= 0.6;
  Side side = beside(retuned);
  CHECK(side.controller_s > 300.0);
  CHECK(side.controller_s < 500.0);
  CHECK(side.change_s == 0.0);
  CHECK(side.foreign_gap_s == Approx(side.controller_s).margin(1.0));
  // In this loop the daemon itself has changed the controller.
  CHECK(side.own_gap_s == 0.0);

  Change limited;
  limited.pid.output_high = 4.8;
  side = beside(limited);
  CHECK(side.controller_s > 300.0);
  CHECK(side.change_s == 0.0);
}

TEST_CASE("a controller that the healthy record does not show is not watched, with the reason",
          "[twin]") {
  plant::LoopModel twin = twin_model();
  twin.twin->controller->rms = 0.2;
  Change retuned;
  retuned.pid.gains.kp *= 0.6;
  CHECK(beside(retuned, twin).controller_s == 0.0);
  CHECK_THAT(ControllerWatch(twin).why_not(), Catch::Contains("feed-forward"));
  twin.twin->controller.reset();
  CHECK_THAT(ControllerWatch(twin).why_not(), Catch::Contains("commission"));
  CHECK(ControllerWatch(twin_model()).why_not().empty());
}

TEST_CASE("dead time of 2 s more is seen within five moves of SP, and a lag", "[twin]") {
  Change later;
  later.plant.process.dead_time_s += 2.0;
  Side side = beside(later);
  CHECK(side.change_s > 300.0);
  CHECK(side.change_s < 300.0 + 5 * 120.0);
  Change slower;
  slower.plant.process.second_time_constant_s = 3.0;
  side = beside(slower);
  CHECK(side.change_s > 300.0);
  CHECK(side.change_s < 300.0 + 5 * 120.0);
}

TEST_CASE("a load that steps or drifts is a load of its size and no change of the loop", "[twin]") {
  Change step;
  step.load = [](double t) { return t >= 350.0 ? 0.6 : 0.0; };
  Side side = beside(step);
  CHECK(side.change_s == 0.0);
  CHECK(side.controller_s == 0.0);
  CHECK(side.load_s > 350.0);
  CHECK(side.load_s < 380.0);
  CHECK(side.load_size == Approx(0.6).margin(0.1));
  Change drift;
  drift.load = [](double t) { return 0.001 * std::max(0.0, t - 300.0); };
  side = beside(drift);
  CHECK(side.change_s == 0.0);
  CHECK(side.load_s > 300.0);
  CHECK(side.load_size > 0.5);
}

TEST_CASE("without movement the loop stays untested", "[twin]") {
  Change still;
  still.sp_move = 0.0;
  for (const double untested_s : beside(still).untested_s) CHECK(untested_s > 1000.0);
  Change moving;
  moving.sp_move = 2.0;
  const Side side = beside(moving);
  CHECK(side.untested_s[static_cast<std::size_t>(TwinChange::gain)] < 240.0);
  CHECK(side.untested_s[static_cast<std::size_t>(TwinChange::dead_time)] < 240.0);
}

TEST_CASE("a monitor remarks the findings of its watches", "[twin]") {
  Change moving;
  moving.sp_move = 2.0;
  Side side = beside(moving);
  CHECK(side.own.judging == watch::Judging::here);
  CHECK_FALSE(side.own.load);
  CHECK_FALSE(side.own.controller);
  REQUIRE(side.foreign.controller);
  CHECK(side.foreign.controller->tested);
  const auto gain = static_cast<std::size_t>(TwinChange::gain);
  CHECK(side.own.untested[gain].tested);
  CHECK(side.own.untested[gain].for_s == side.untested_s[gain]);
  Change still;
  still.sp_move = 0.0;
  still.load = [](double t) { return t >= 350.0 ? 0.6 : 0.0; };
  side = beside(still);
  CHECK_FALSE(side.own.untested[gain].tested);
  REQUIRE(side.own.load);
  CHECK(side.own.load->size == Approx(0.6).margin(0.1));
  // Higher than any PV of the healthy record.
  moving.sp_move = 4.8;
  moving.at_s = 0.0;
  plant::LoopModel twin = twin_model();
  twin.twin->seen_high = 6.0;
  CHECK(beside(moving, twin).own.judging == watch::Judging::outside);
}

}  // namespace twin_side_test
