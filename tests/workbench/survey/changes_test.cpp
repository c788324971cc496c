// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/changes.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/survey/survey_support.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::tests::changes_test {
namespace {

using nlohmann::json;
using namespace loopwarden::workbench;

std::string change_of(const json& changes, const std::string& tag) {
  for (const json& loop : changes.at("loops")) {
    if (loop.at("tag") == tag) return loop.at("change");
  }
  return {};
}

TEST_CASE("changes since an earlier survey are listed", "[survey][changes]") {
  json held = valve_loop("H", 4.0);
  held["held_back"] = true;
  const json before =
      survey_of({valve_loop("A", 4.0), valve_loop("B", 4.0), valve_loop("C", 4.0),
                 valve_loop("D", 4.0), survey_loop("E", "healthy"), caused_loop("F", "tuning", 1.0),
                 caused_loop("G", "tuning", 1.0), valve_loop("H", 4.0), valve_loop("I", 4.0),
                 valve_loop("J", 4.0), survey_loop("K", "healthy"), valve_loop("L", 4.0)});
  const json now = survey_of({valve_loop("A", 6.0), valve_loop("B", 5.9), valve_loop("C", 2.6),
                              survey_loop("D", "healthy"), valve_loop("E", 3.0),
                              caused_loop("F", "tuning", 1.6), caused_loop("G", "disturbance", 1.0),
                              held, survey_loop("I", "cant_tell"), survey_loop("K", "healthy"),
                              valve_loop("L", 4.0, "backlash"), valve_loop("M", 1.0)});
  const json changes = compare_surveys(now, before, {});
  CHECK(change_of(changes, "A") == "worse");
  CHECK(change_of(changes, "B") == "same");
  CHECK(change_of(changes, "C") == "better");
  CHECK(change_of(changes, "D") == "gone");
  CHECK(change_of(changes, "E") == "new");
  CHECK(change_of(changes, "F") == "worse");
  CHECK(change_of(changes, "G") == "new");
  CHECK(change_of(changes, "H") == "rejected");
  CHECK(change_of(changes, "I") == "unknown");
  CHECK(change_of(changes, "J") == "unknown");  // no longer surveyed
  CHECK(change_of(changes, "K").empty());
  CHECK(change_of(changes, "L") == "same");  // the valve, by another name
  CHECK(change_of(changes, "M") == "new");
  CHECK(changes["counts"] == json{{"new", 3},
                                  {"worse", 2},
                                  {"better", 1},
                                  {"gone", 1},
                                  {"rejected", 1},
                                  {"unknown", 2},
                                  {"same", 2}});
  CHECK(changes["now"]["from"] == "2026-10-01T00:00:00Z");
  const std::string text = changes_text(changes);
  CHECK_THAT(text,
             Catch::Contains("new 3, worse 2, better 1, gone 1, rejected 1, unknown 2, same 2"));
  CHECK_THAT(text, Catch::Contains("not in this survey"));
  // The page needs no other file.
  const std::string page = changes_page(changes);
  CHECK(page.find("href=") == std::string::npos);
  CHECK(page.find("src=") == std::string::npos);
  CHECK_THAT(page, Catch::Contains("backlash 4 %, seen"));
}

TEST_CASE("the area is in the tag", "[survey][changes]") {
  const auto area = [](const char* tag) { return area_of(tag, std::nullopt); };
  CHECK(area("21-FIC-105") == "21");
  CHECK(area("21FIC105") == "21");
  CHECK(area("U100_FIC101A") == "U100");
  CHECK(area("/Plant/Area1/FIC101") == "Plant/Area1");
  CHECK(area("FIC2105A") == "21");
  CHECK(area("FIC-101") == "1");
  CHECK(area("FIC12") == "-");
  CHECK(area("Kessel2") == "Kessel");
  CHECK(area("dryer-3") == "dryer");
  const auto told = [](const char* pattern, const char* tag) {
    return area_of(tag, record::TagPattern(pattern));
  };
  CHECK(told("[A-Z]IC?*", "FIC2105") == "F");
  CHECK(told("*_*", "U1_FIC_3") == "U1");
  CHECK(told("U*_*", "FIC101") == "-");
}

TEST_CASE("criticality and cost order the loops and sum up by area", "[survey][changes]") {
  const TemporaryFolder folder;
  write_file(folder / "l.csv",
             "Tag;Service;Criticality;Cost_per_hour\nFIC101;feed;B;12,5\nFIC102;;A;\nFIC201;;b;"
             "20\nFIC901;;;\n");
  Comparing how;
  how.weights = read_loop_weights(folder / "l.csv");
  CHECK(how.weights.at("FIC101").cost_per_hour == 12.5);
  CHECK(how.weights.at("FIC101").order == how.weights.at("FIC201").order);
  const json now =
      survey_of({valve_loop("FIC101", 3.0), valve_loop("FIC102", 3.0), valve_loop("FIC201", 3.0),
                 valve_loop("FIC103", 9.0), survey_loop("FIC202", "healthy")});
  const json changes = compare_surveys(now, survey_of({}), how);
  std::vector<std::string> order;
  for (const json& loop : changes["loops"]) order.push_back(loop["tag"]);
  CHECK(order == std::vector<std::string>{"FIC102", "FIC201", "FIC101", "FIC103"});
  REQUIRE(changes["areas"].size() == 2);
  CHECK(changes["areas"][0]["area"] == "1");
  CHECK(changes["areas"][0]["cost_per_hour"] == 12.5);
  CHECK(changes["areas"][0]["new"] == 3);
  CHECK(changes["areas"][1]["loops"] == 2);
  CHECK(changes["areas"][1]["findings"] == 1);
  CHECK(changes["not_in_survey"] == json{"FIC901"});
  CHECK_THAT(changes_text(changes), Catch::Contains("1 of --loops in neither survey: FIC901"));
  CHECK_THAT(changes_page(changes), Catch::Contains("<th>Cost /h</th>"));
}

TEST_CASE("errors of the loops' file are reported with their place", "[survey][changes]") {
  const TemporaryFolder folder;
  const auto error_of = [&](const std::string& text) {
    write_file(folder / "l.csv", text);
    try {
      read_loop_weights(folder / "l.csv");
    } catch (const CommandError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  using Catch::Contains;
  CHECK_THAT(error_of("tags,cost_per_hour\nF1,3\n"),
             Contains("l.csv:1:1: no column 'tag'; did you mean 'tags'?"));
  CHECK_THAT(error_of("tag,criticality\nF1,very\n"),
             Contains("l.csv:2:4: criticality is a number, a letter"));
  CHECK_THAT(error_of("tag,cost_per_hour\nF1,-3\n"),
             Contains("l.csv:2:4: cost_per_hour is a number"));
  CHECK_THAT(error_of("tag\nF1\nF2\nF1\n"), Contains("l.csv:4:1: 'F1' is in line 2 already"));
  CHECK(error_of("tag,criticality\nF1,high\nF2,2\nF3,\n").empty());
}

TEST_CASE("only a survey.json is accepted as one", "[survey][changes]") {
  const TemporaryFolder folder;
  for (const char* text : {"", "[]", "{}", "{\"loops\": 3}", "{\"loops\": [{\"tag\": \"F1\"}]}"}) {
    INFO(text);
    write_file(folder / "survey.json", text);
    CHECK_THROWS_WITH(read_survey(folder.path()),
                      Catch::Contains("survey.json: is no survey.json"));
  }
  write_file(folder / "survey.json", survey_of({valve_loop("F1", 3.0)}).dump());
  CHECK(read_survey(folder / "survey.json")["loops"].size() == 1);
  CHECK_THROWS_AS(read_survey(folder / "none.json"), CommandError);
}

}  // namespace
}  // namespace loopwarden::tests::changes_test
