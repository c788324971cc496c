// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "config/loop_reader.hpp"
#include "tests/config/config_support.hpp"

namespace alarms_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using alarm::AlarmKind;
using test::kAnalogLoop;
using test::kModbusLoop;
using test::said_of_loop;

namespace {

LoopAlarmConfig read(const std::string& alarms) {
  const auto loaded = read_loop_text("loop.yaml", kModbusLoop + alarms, test::daemon());
  REQUIRE(loaded);
  return loaded.value->alarms;
}

std::string said(const std::string& alarms) { return said_of_loop(kModbusLoop + alarms); }

}  // namespace

TEST_CASE("A limit alarm exists if the loop's file has one", "[config][alarms]") {
  const LoopAlarmConfig none = read("");
  for (const AlarmKind kind : alarm::kLimitAlarms) CHECK_FALSE(none.process.at(kind).fitted);
  CHECK(none.process.at(AlarmKind::bad_pv).fitted);
  CHECK_FALSE(none.process.at(AlarmKind::source_lost).fitted);
  CHECK_FALSE(none.process.at(AlarmKind::enable_open).fitted);

  const LoopAlarmConfig some = read(
      "alarms:\n"
      "  pv_high: {limit: 8, dead_band: 0.25, on_delay: 3, off_delay: 4, priority: critical}\n"
      "  pv_low_low: {limit: 1}\n"
      "  deviation: {limit: 2, time_constant: 5}\n"
      "  rate_of_change: {limit: 0.5, over: 20}\n");
  const alarm::ProcessSettings& process = some.process;
  CHECK(process.limits.at(AlarmKind::pv_high) == alarm::Limit{8.0, 0.25});
  CHECK(process.at(AlarmKind::pv_high) == alarm::ProcessRule{true, 3.0, 4.0});
  CHECK(some.priority[alarm::index_of(AlarmKind::pv_high)] == alarm::Priority::critical);
  CHECK(process.limits.at(AlarmKind::pv_low_low) == alarm::Limit{1.0, 0.1});  // 1 % of the span
  CHECK(process.at(AlarmKind::pv_low_low) == alarm::ProcessRule{true, 2.0, 60.0});
  CHECK(process.limits.at(AlarmKind::deviation) == alarm::Limit{2.0, 0.2});
  CHECK(process.at(AlarmKind::deviation) == alarm::ProcessRule{true, 60.0, 60.0});
  CHECK(process.limits.settle_s == 15.0);
  CHECK(process.limits.rate_time_s == 20.0);
  CHECK_FALSE(process.at(AlarmKind::pv_low).fitted);
}

TEST_CASE("A loop's file may have other texts for an alarm, also for a valve alarm",
          "[config][alarms]") {
  const LoopAlarmConfig alarms = read(
      "alarms:\n  stiction: {priority: medium, action: call the valve shop}\n"
      "  bad_pv: {cause: \"FT-101, DP cell\", time_to_act: 5 min}\n");
  CHECK(alarms.guide(AlarmKind::stiction).action == "call the valve shop");
  CHECK(alarms.guide(AlarmKind::stiction).cause == alarm::guide_of(AlarmKind::stiction).cause);
  CHECK(alarms.guide(AlarmKind::bad_pv).cause == "FT-101, DP cell");
  CHECK(alarms.guide(AlarmKind::bad_pv).time_to_act == "5 min");
  CHECK(alarms.priority[alarm::index_of(AlarmKind::stiction)] == alarm::Priority::medium);
}

TEST_CASE("Impossible limits are reported with the expected ones", "[config][alarms]") {
  using Catch::Contains;
  CHECK_THAT(said("alarms:\n  pv_high: {limit: 10}\n"),
             Contains("alarms.pv_high.limit: must lie inside the range of PV, [0, 10]"));
  CHECK_THAT(said("alarms:\n  pv_high: {dead_band: 1}\n"), Contains("missing key 'limit'"));
  CHECK_THAT(said("alarms:\n  pv_low: {limit: 6}\n  pv_high: {limit: 5}\n"),
             Contains("alarms.pv_high: its limit must be above that of pv_low, 6 (got 5)"));
  CHECK_THAT(
      said("alarms:\n  pv_low: {limit: 4, dead_band: 1}\n  pv_high: {limit: 6, dead_band: 1}\n"),
      Contains("leave no normal range"));
  CHECK_THAT(said("alarms:\n  deviation: {limit: 2}\n"), Contains("missing key 'time_constant'"));
  CHECK_THAT(said("alarms:\n  deviation: {limit: 2, dead_band: 2, time_constant: 5}\n"),
             Contains("alarms.deviation.dead_band: must be less than limit = 2 (got 2)"));
  CHECK_THAT(said("alarms:\n  pv_hihg: {limit: 5}\n"), Contains("pv_high"));
  CHECK_THAT(said("alarms:\n  stiction: {limit: 5}\n"), Contains("limit"));
  CHECK_THAT(said("alarms:\n  bad_pv: {priority: urgent}\n"),
             Contains("alarms.bad_pv.priority: must be low, medium, high or critical"));
}

TEST_CASE("A loop with an enable contact has its alarm", "[config][alarms]") {
  const auto wired = [](const std::string& text) {
    const auto loaded = read_loop_text("loop.yaml", text, test::daemon());
    REQUIRE(loaded);
    return loaded.value->alarms.process.at(AlarmKind::enable_open).fitted;
  };
  CHECK_FALSE(wired(kAnalogLoop));
  CHECK(wired(kAnalogLoop + "  enable: {line: ENABLE, active_low: true, debounce: 0.1}\n"));
}

TEST_CASE("An alarm that a loop does not have is reported at its place in the file",
          "[config][alarms]") {
  using Catch::Contains;
  const std::string enable = "alarms:\n  enable_open: {priority: low}\n";
  CHECK(
      said(enable) ==
      "loop.yaml:" + std::to_string(std::count(kModbusLoop.begin(), kModbusLoop.end(), '\n') + 2) +
          ":16: warning: alarms.enable_open: the loop has no such alarm: io has no enable "
          "contact\n");
  CHECK_FALSE(read(enable).process.at(AlarmKind::enable_open).fitted);
  CHECK(said_of_loop(kAnalogLoop + "  enable: {line: ENABLE, active_low: true, debounce: 0.1}\n" +
                     enable)
            .find("no such alarm") == std::string::npos);
  CHECK_THAT(said("alarms:\n  source_lost: {off_delay: 5}\n"),
             Contains("alarms.source_lost: the loop has no such alarm: it is controlled here"));
}

}  // namespace alarms_reader_test
