// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/loop_view.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace loop_view_test {

using namespace loopwarden::workbench;
namespace protocol = loopwarden::protocol;

namespace {

protocol::LoopStatus loop(const std::string& name) {
  return {.name = name,
          .description = "cooling water",
          .io = {.transactions = 900,
                 .timeouts = 1,
                 .device_exceptions = 2,
                 .invalid_replies = 3,
                 .reconnects = 4},
          .recording = {.rows = 50, .dropped = 6, .bytes = 2'500'000, .rows_lost = 1},
          .monitor = {.window_state = "judged",
                      .windows = 7,
                      .oscillation_index = 1.4,
                      .oscillation_period_s = 21.5,
                      .stick_percent = 5.2,
                      .stick_source = "read-back",
                      .condition = {.control_performance = 41.6,
                                    .valve = 12.0,
                                    .actuator = 100.0,
                                    .environment = 0.4}},
          .cycle = protocol::Cycle{
              .fault = "none", .pv_age_ms = 12.34, .ne107 = "out_of_specification"}};
}

}  // namespace

TEST_CASE("alarms that can't be raised at present are shown as no fault", "[workbench][alarms]") {
  const auto alarm = [](const char* state, bool active) {
    return protocol::Alarm{.state = state, .active = active};
  };
  std::vector<protocol::Alarm> answer{alarm("normal", false), alarm("unacknowledged", true)};
  CHECK(suppressed_note(answer).empty());
  // An active alarm is in the table, with its explanation.
  answer.push_back(alarm("suppressed", true));
  CHECK(suppressed_note(answer).empty());
  answer.push_back(alarm("suppressed", false));
  CHECK(suppressed_note(answer).find("1 alarm cannot be raised at present. This is normal: "
                                     "windows are still filling") == 0);
  answer.push_back(alarm("suppressed", false));
  CHECK(suppressed_note(answer).find("2 alarms cannot be raised") == 0);
}

TEST_CASE("a loop is shown with its area and its cascade", "[workbench][top][cascade]") {
  std::vector<protocol::LoopStatus> loops{loop("TIC-100"), loop("FIC-101"), loop("FIC-102")};
  CHECK(place_line(loops, 0).empty());
  for (protocol::LoopStatus& one : loops) one.cycle->mode = "AUTO";
  loops[1].area = "Unit 2/Reactor";
  loops[1].master = loops[2].master = "TIC-100";
  CHECK(place_line(loops, 0) == "master of FIC-101 (AUTO), FIC-102 (AUTO)\n");
  CHECK(place_line(loops, 1) == "area Unit 2/Reactor   slave of TIC-100 (AUTO)\n");
  loops.erase(loops.begin());
  CHECK(place_line(loops, 1) == "slave of TIC-100\n");  // not among the listed loops
}

TEST_CASE("the details of a loop show the numbers of its status", "[workbench][top]") {
  const std::vector<std::string> lines = loop_details(loop("FIC-101"));
  REQUIRE(lines.size() == 3);
  const auto has = [&](std::size_t line, const std::string& words) {
    INFO(lines[line]);
    CHECK(lines[line].find(words) != std::string::npos);
  };
  has(0, "window 7: judged");
  has(0, "oscillates at 21.5 s");
  has(0, "stick 5.2 % (read-back)");
  // An unknown index is shown as a dash.
  has(1, "control performance 42   valve 12   actuator 100   positioner -   environment 0");
  has(2, "FIC-101: cooling water   PV age 12.3 ms   position age - ms");
  has(2, "50 rows, 7 lost, 2.5 MB");
  has(2, "900 transactions, 1 timeouts, 2 exceptions, 3 invalid, 4 reconnects");
}

TEST_CASE("the twin's state has a line in addition to its alarm", "[workbench][top]") {
  protocol::LoopStatus one = loop("FIC-101");
  one.pv_unit = "L/min";
  one.monitor.twin = {.judging = "here",
                      .untested = {{"gain", 30.0, true}, {"dead_time", 260'000.0, true}}};
  CHECK(loop_details(one).at(2) == "twin: judges   last tested: dead time 3.0 d ago");
  one.monitor.twin = {.judging = "outside",
                      .load_outside = {{.size = 0.62, .since_s = 720.0}},
                      .controller_not_watched = "something else moves it",
                      .untested = {{"lag", 5400.0, false}}};
  CHECK(loop_details(one).at(2) ==
        "twin: not judging (PV or CO outside the commissioned range)   disturbance +0.62 L/min "
        "outside the commissioned range for 12 min   controller not watched: something else moves "
        "it   last tested: lag not "
        "in 90 min since the start");
}

TEST_CASE("the details show who commissions a loop, since when, and when that times out",
          "[workbench][top]") {
  protocol::LoopStatus one = loop("FIC-101");
  CHECK(loop_table({one}, 0).at(1).find("commissioned") == std::string::npos);
  one.commissioning = {.by = "uid 0", .since_ms = 1'800'000'000'000, .ends_in_s = 57.4};
  CHECK(loop_table({one}, 0).at(1).find("in maintenance by uid 0") != std::string::npos);
  CHECK(loop_details(one).at(2) ==
        "in maintenance by uid 0 since 2027-01-15T08:00:00Z; other users can only select manual; "
        "ends in 57 s if the session stays silent");
  one.commissioning->ends_in_s = 0.0;
  CHECK(loop_details(one).at(2).ends_with("session silent: stop action"));
}

TEST_CASE("a loop with an unknown output is not shown as running", "[workbench][top]") {
  protocol::LoopStatus unknown = loop("FIC-101");
  unknown.cycle = {.sp = 27.5, .pv = 31.0, .mode = "FALLBACK", .fault = "output unknown"};
  unknown.pv_unit = "L/min";
  unknown.co_unit = "%";
  const std::string line = loop_table({unknown}, 0).at(1);
  INFO(line);
  CHECK(line.find("FALLBACK") != std::string::npos);
  CHECK(line.find("output unknown") != std::string::npos);
  CHECK(line.find(" %") == std::string::npos);  // no CO, no stem
  CHECK(line.find("ok") == std::string::npos);
}

TEST_CASE("a watched loop without values has no fallback", "[workbench][top]") {
  protocol::LoopStatus watched = loop("FIC-205");
  watched.control = "elsewhere";
  watched.cycle = {.time_s = 3600.0,
                   .mode = "FALLBACK",
                   .fault = "bad PV",
                   .pv_quality = "bad",
                   .pv_reason = "link lost",
                   .pv_age_ms = 65'400.0};
  const auto line = [&] { return loop_table({watched}, 0).at(1); };
  CHECK(line().find("no valid PV for 0:01:05 (link lost)") != std::string::npos);
  CHECK(line().find("FALLBACK") == std::string::npos);
  watched.cycle->pv_age_ms = 1e9;  // of no value since the start
  CHECK(line().find("no valid PV yet (link lost)") != std::string::npos);
  watched.cycle->pv_quality = "good";  // in a mode that its file does not name
  CHECK(line().find("OTHER") != std::string::npos);
}

TEST_CASE("the writes to the disk are shown with their budget once they are known") {
  protocol::DaemonStatus daemon;
  CHECK(writes_line(daemon).empty());
  daemon.recorder = {.sync_s = 60.0, .written_mb_per_day = 171.4, .write_budget_mb_per_day = 465.0};
  CHECK(writes_line(daemon) == "disk  171 MB a day written, budget 465 MB  rows every 60 s");
  daemon.recorder.write_budget_mb_per_day = protocol::kNone;
  CHECK(writes_line(daemon) == "disk  171 MB a day written  rows every 60 s");
}

TEST_CASE("data that does not reach the disk is reported with the reason", "[workbench][top]") {
  protocol::DaemonStatus daemon;
  CHECK(disk_troubles(daemon).empty());
  daemon.journal = {.error = "another version", .waiting = 3, .lost = 1};
  CHECK(disk_troubles(daemon) ==
        std::vector<std::string>{
            "journal not written (3 waiting in memory, 1 lost): another version"});
}

TEST_CASE("a stick that was not measured is a dash", "[workbench][top]") {
  protocol::LoopStatus still = loop("FIC-101");
  still.monitor.stick_percent = protocol::kNone;
  still.monitor.stick_source = "none";
  const std::string line = loop_details(still)[0];
  CHECK(line.substr(line.size() - 7) == "stick -");
}

TEST_CASE("a loop whose oscillation index is below 1 has no oscillation within its window",
          "[workbench][top]") {
  protocol::LoopStatus quiet = loop("FIC-101");
  quiet.monitor.oscillation_index = 0.9;
  CHECK(loop_details(quiet)[0].find("no oscillation within it") != std::string::npos);
}

TEST_CASE("a compensator is shown with what it adds, apart from the jacket", "[workbench][top]") {
  protocol::LoopStatus one = loop("FIC-101");
  one.co_unit = "V";
  protocol::Compensator& compensator = one.cycle->compensator;
  compensator = {.kind = "knocker", .acting = true, .added = -0.25};
  const auto shown = [&] { return loop_table({one}, 0).back(); };
  CHECK(shown().find("knocker adds -0.25 V") != std::string::npos);
  CHECK(shown().find("jacket") == std::string::npos);
  compensator.acting = false;
  CHECK(shown().find("knocker idle") != std::string::npos);
  compensator.kind = "none";
  CHECK(shown().find("idle") == std::string::npos);
}

TEST_CASE("a PV at the end of what its transmitter can measure is shown", "[workbench][top]") {
  protocol::LoopStatus one = loop("FIC-101");
  const auto shown = [&](const char* limit) {
    one.cycle->pv_limit = limit;
    return loop_table({one}, 0).at(1).find("PV at its high limit") != std::string::npos;
  };
  CHECK(shown("high"));
  CHECK_FALSE(shown("none"));
}

TEST_CASE("a loop is found by its name, and only by that", "[workbench][top]") {
  const std::vector<protocol::LoopStatus> loops{loop("FIC-101"), loop("FIC-102")};
  CHECK(loop_index(loops, "FIC-101") == 0);
  CHECK(loop_index(loops, "FIC-102") == 1);
  CHECK_THROWS_AS(loop_index(loops, "FIC-10"), std::runtime_error);
}

}  // namespace loop_view_test
