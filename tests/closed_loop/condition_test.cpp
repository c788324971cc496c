// SPDX-License-Identifier: Apache-2.0
// The condition indices of a simulated loop with a deteriorating valve, as the daemon's monitor
// shows them.
#include <catch2/catch.hpp>
#include <cmath>

#include "config/loop_model_reader.hpp"
#include "daemon/supervision/monitor.hpp"
#include "hal/contract/sample.hpp"
#include "model/plant/simulated_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::condition_test {
namespace {

using record::RecordRow;

struct Trial {
  bool read_back = true;
  std::vector<plant::ScheduledFault> faults;
};

analysis::ConditionIndices indices_of(const Trial& trial) {
  plant::LoopModel model =
      *config::read_model_file(LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml");
  // Set points that cross any play in both directions, several times per window.
  model.scenario = {.duration_s = 600.0, .set_point = {}, .faults = trial.faults, .seed = 11};
  for (int k = 0; k < 24; ++k) {
    model.scenario.set_point.emplace_back(25.0 * k, k % 2 == 0 ? 5.0 : 5.6);
  }
  plant::SimulatedLoop loop(model);

  TemporaryFolder folder;
  daemon::journal::Journal journal({.folder = folder.path()});
  daemon::supervision::AlarmRegistry board({{"FIC-101", 0.1}}, {}, journal, [] { return 0; });
  base::SpscRing<RecordRow> cycles(256);
  daemon::supervision::Monitor monitor(
      {{.cycles = &cycles,
        .window = {.sample_time_s = model.sample_time_s, .pv_high = 10.0, .co_high = 10.0},
        .judge = nullptr,
        .rule = {}}},
      board);
  for (std::uint64_t k = 0; k < 6000; ++k) {
    const plant::LoopSample s = loop.step();
    RecordRow row;
    row.period_index = k;
    row.sp = s.sp;
    row.pv = s.pv;
    row.co = s.co;
    row.stem = trial.read_back ? s.stem : std::nan("");
    row.mode = control::Mode::automatic;
    row.pv_quality = hal::Quality::good;
    REQUIRE(cycles.try_push(row));
    if (k % 100 == 99) monitor.round();
  }
  monitor.round();
  return board.snapshot(0).condition;
}

plant::ScheduledFault fault(const char* effect, std::map<std::string, double> parameters) {
  return {.effect = {.name = effect, .parameters = std::move(parameters)}, .schedule = {}};
}

}  // namespace

TEST_CASE("a healthy valve's index stays high, a sticking one's falls with the stick band",
          "[closed_loop][condition]") {
  const analysis::ConditionIndices healthy = indices_of({});
  CHECK(healthy.valve > 90.0);
  CHECK(healthy.actuator > 90.0);
  CHECK(healthy.positioner > 80.0);
  CHECK(healthy.environment == 100.0);
  const auto sticking = [](double s) {
    return indices_of({.faults = {fault("stiction", {{"s", s}, {"j", 0.5 * s}})}});
  };
  const analysis::ConditionIndices some = sticking(0.4);
  const analysis::ConditionIndices more = sticking(0.8);
  // 4 and 8 % of the CO span against a limit of 10 %.
  CHECK(some.valve == Approx(60.0).margin(12.0));
  CHECK(more.valve == Approx(20.0).margin(12.0));
  CHECK(more.control_performance < healthy.control_performance);
  CHECK(more.environment == 100.0);
}

TEST_CASE("a stem that has too little air lowers the actuator's index",
          "[closed_loop][condition]") {
  const analysis::ConditionIndices starved =
      indices_of({.faults = {fault("low_air_supply", {{"rate", 0.02}, {"travel_limit", 10.0}})}});
  CHECK(starved.actuator < 80.0);
}

TEST_CASE("without a read-back the indices that need one are unknown", "[closed_loop][condition]") {
  const analysis::ConditionIndices indices = indices_of({.read_back = false, .faults = {}});
  CHECK(std::isfinite(indices.control_performance));
  CHECK(indices.environment == 100.0);
  CHECK(std::isnan(indices.valve));
  CHECK(std::isnan(indices.actuator));
  CHECK(std::isnan(indices.positioner));
}

}  // namespace loopwarden::tests::condition_test
