// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/loop_view.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace loop_view_test {

using namespace loopwarden::workbench;
using nlohmann::json;

namespace {

json loop(const std::string& name) {
  return {{"name", name},
          {"description", "cooling water"},
          {"ne107", "out_of_specification"},
          {"pv_age_ms", 12.34},
          {"position_age_ms", nullptr},
          {"io",
           {{"transactions", 900},
            {"timeouts", 1},
            {"device_exceptions", 2},
            {"invalid_replies", 3},
            {"reconnects", 4}}},
          {"recording", {{"rows", 50}, {"dropped", 6}, {"rows_lost", 1}, {"bytes", 2.5e6}}},
          {"monitor",
           {{"windows", 7},
            {"window_state", "judged"},
            {"oscillation_index", 1.4},
            {"oscillation_period_s", 21.5},
            {"stick_percent", 5.2},
            {"stick_source", "read-back"},
            {"condition",
             {{"control_performance", 41.6},
              {"valve", 12.0},
              {"actuator", 100.0},
              {"positioner", nullptr},
              {"environment", 0.4}}}}}};
}

}  // namespace

TEST_CASE("alarms that can't come at present are no trouble, and said to be none",
          "[workbench][alarms]") {
  const auto alarm = [](const char* state, bool active) {
    return json{{"state", state}, {"active", active}};
  };
  json answer{{"alarms", json::array({alarm("normal", false), alarm("unacknowledged", true)})}};
  CHECK(suppressed_note(answer).empty());
  // One that is on stands in the table, with what explains it.
  answer["alarms"].push_back(alarm("suppressed", true));
  CHECK(suppressed_note(answer).empty());
  answer["alarms"].push_back(alarm("suppressed", false));
  CHECK(suppressed_note(answer).find("1 alarm can't be raised at present, which is no fault: "
                                     "windows are still filling") == 0);
  answer["alarms"].push_back(alarm("suppressed", false));
  CHECK(suppressed_note(answer).find("2 alarms can't be raised") == 0);
}

TEST_CASE("the details of a loop are the numbers of its status", "[workbench][top]") {
  const std::vector<std::string> lines = loop_details(loop("FIC-101"));
  REQUIRE(lines.size() == 3);
  const auto has = [&](std::size_t line, const std::string& words) {
    INFO(lines[line]);
    CHECK(lines[line].find(words) != std::string::npos);
  };
  has(0, "window 7: judged");
  has(0, "oscillates at 21.5 s");
  has(0, "stick 5.2 % (read-back)");
  // An index that is not known is no number.
  has(1, "control performance 42   valve 12   actuator 100   positioner -   environment 0");
  has(2, "FIC-101: cooling water   PV age 12.3 ms   position age - ms");
  has(2, "50 rows, 7 lost, 2.5 MB");
  has(2, "900 transactions, 1 timeouts, 2 exceptions, 3 invalid, 4 reconnects");
}

TEST_CASE("a loop whose output is not known looks like no loop that runs", "[workbench][top]") {
  json unknown = loop("FIC-101");
  unknown.update({{"mode", "FALLBACK"},
                  {"fault", "output unknown"},
                  {"sp", 27.5},
                  {"pv", 31.0},
                  {"co", nullptr},
                  {"pv_unit", "L/min"},
                  {"co_unit", "%"}});
  const std::string line = loop_table({{"loops", {unknown}}}, 0).at(1);
  INFO(line);
  CHECK(line.find("FALLBACK") != std::string::npos);
  CHECK(line.find("output unknown") != std::string::npos);
  CHECK(line.find(" %") == std::string::npos);  // no CO, no stem
  CHECK(line.find("ok") == std::string::npos);
}

TEST_CASE("what does not reach the disk is said, with why", "[workbench][top]") {
  const json none{{"waiting", 0}, {"lost", 0}, {"error", ""}};
  json status{{"daemon", {{"journal", none}, {"evidence", none}}}};
  CHECK(disk_troubles(status).empty());
  status["daemon"]["journal"] = {{"waiting", 3}, {"lost", 1}, {"error", "another version"}};
  CHECK(disk_troubles(status) ==
        std::vector<std::string>{
            "journal not written (3 waiting in memory, 1 lost): another version"});
}

TEST_CASE("a stick that was not measured is a dash", "[workbench][top]") {
  json still = loop("FIC-101");
  still["monitor"]["stick_percent"] = nullptr;
  still["monitor"]["stick_source"] = "none";
  const std::string line = loop_details(still)[0];
  CHECK(line.substr(line.size() - 7) == "stick -");
}

TEST_CASE("a loop whose oscillation index is below 1 does not oscillate", "[workbench][top]") {
  json quiet = loop("FIC-101");
  quiet["monitor"]["oscillation_index"] = 0.9;
  CHECK(loop_details(quiet)[0].find("does not oscillate") != std::string::npos);
}

TEST_CASE("a compensator is shown with what it adds, apart from the jacket", "[workbench][top]") {
  json one = loop("FIC-101");
  one["fault"] = "none";
  one["co_unit"] = "V";
  one["jacket"] = {{"form", "off"}, {"acting", false}, {"rate", 0.0}};
  one["compensator"] = {{"kind", "knocker"}, {"acting", true}, {"added", -0.25}};
  const auto shown = [&] { return loop_table({{"loops", json::array({one})}}, 0).back(); };
  CHECK(shown().find("knocker adds -0.25 V") != std::string::npos);
  CHECK(shown().find("jacket") == std::string::npos);
  one["compensator"]["acting"] = false;
  CHECK(shown().find("knocker idle") != std::string::npos);
  one["compensator"]["kind"] = "none";
  CHECK(shown().find("idle") == std::string::npos);
}

TEST_CASE("a PV at the end of what its transmitter can measure is shown", "[workbench][top]") {
  json one = loop("FIC-101");
  one["fault"] = "none";
  const auto shown = [&](const char* limit) {
    one["pv_limit"] = limit;
    return loop_table({{"loops", json::array({one})}}, 0).at(1).find("PV at its high limit") !=
           std::string::npos;
  };
  CHECK(shown("high"));
  CHECK_FALSE(shown("none"));
}

TEST_CASE("a loop is found by its name, and only by that", "[workbench][top]") {
  const json status{{"loops", {loop("FIC-101"), loop("FIC-102")}}};
  CHECK(loop_index(status, "FIC-101") == 0);
  CHECK(loop_index(status, "FIC-102") == 1);
  CHECK_THROWS_AS(loop_index(status, "FIC-10"), std::runtime_error);
}

}  // namespace loop_view_test
