// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/outcomes.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/survey/survey_support.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/survey/join.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::tests::outcomes_test {
namespace {

using nlohmann::json;
using namespace loopwarden::workbench;

FitterAnswer answer(const json& loop, AtValve found, const std::string& note = {}) {
  return answer_for(loop, found, note);
}

std::string error_of(const std::filesystem::path& path, const std::string& text) {
  write_file(path, text);
  try {
    read_outcomes(path);
  } catch (const CommandError& e) {
    return e.what();
  }
  return {};
}

TEST_CASE("an answer is read back unchanged, with the survey's finding", "[outcome]") {
  const TemporaryFolder folder;
  const auto path = folder / kOutcomesFile;
  CHECK(read_outcomes(path).empty());
  json loop = valve_loop("=FIC, \"1\"", 4.25);
  keep_outcome(path, answer(loop, AtValve::stiction, "packing,\ntight \"very\""));
  keep_outcome(path, answer(survey_loop("FIC2", "healthy"), AtValve::air));
  const std::vector<FitterAnswer> read = read_outcomes(path);
  REQUIRE(read.size() == 2);
  CHECK(read[0].tag == "=FIC, \"1\"");
  CHECK(read[0].note == "packing, tight \"very\"");
  CHECK(read[0].found == AtValve::stiction);
  CHECK(read[0].effect == "stiction");
  CHECK(read[0].alternatives == "resolution");
  CHECK(read[0].percent_of_span == 4.25);
  CHECK(read[0].grade == "seen");
  CHECK(read[0].data_from == "2026-10-01T00:00:00Z");
  CHECK(read[0].data_to == "2026-10-01T08:00:00Z");
  CHECK(read[0].answered.size() == 20);
  CHECK(read[1].effect.empty());
  CHECK_FALSE(read[1].percent_of_span);
  // The last answer to a finding counts. Another size is another finding.
  keep_outcome(path, answer(loop, AtValve::nothing));
  loop["effects"][0]["percent_of_span"] = 5.0;
  keep_outcome(path, answer(loop, AtValve::backlash));
  const std::vector<FitterAnswer> later = read_outcomes(path);
  REQUIRE(later.size() == 3);
  CHECK(later[1].found == AtValve::nothing);
  CHECK(later[2].found == AtValve::backlash);
}

TEST_CASE("answers of several users at once are all complete in the file", "[outcome]") {
  const TemporaryFolder folder;
  const auto path = folder / kOutcomesFile;
  std::vector<std::thread> fitters;
  for (int k = 0; k < 8; ++k) {
    fitters.emplace_back([&path, k] {
      for (int n = 0; n < 10; ++n)
        keep_outcome(path, answer(valve_loop("F" + std::to_string(10 * k + n), 3.0), AtValve::air));
    });
  }
  for (std::thread& fitter : fitters) fitter.join();
  CHECK(read_outcomes(path).size() == 80);
  // An answer cut short by a power failure does not merge with the next one.
  const std::string all = read_file(path);
  write_file(path, all.substr(0, all.size() - 10));
  keep_outcome(path, answer(valve_loop("F100", 3.0), AtValve::air));
  CHECK(read_outcomes(path).size() == 81);
  CHECK(read_outcomes(path).back().tag == "F100");
}

TEST_CASE("errors of the file of answers are reported with their place", "[outcome]") {
  const TemporaryFolder folder;
  const auto path = folder / "o.csv";
  using Catch::Contains;
  CHECK_THAT(error_of(path, "tag,fond\nF1,air\n"),
             Contains("o.csv:1:1: no column 'found'; did you mean 'fond'?"));
  CHECK_THAT(error_of(path, "found,tag\nsticktion,F1\n"),
             Contains("o.csv:2:1: 'sticktion' is none of stiction") &&
                 Contains("did you mean 'stiction'?"));
  CHECK_THAT(error_of(path, "tag,found\n,air\n"), Contains("o.csv:2:1: no tag"));
  CHECK_THAT(error_of(path, "tag,found,percent_of_span\nF1,air,much\n"),
             Contains("o.csv:2:8: 'much' is not a number"));
  CHECK_THAT(error_of(path, "tag,found\n\"F1,air\n"), Contains("o.csv:2:1: no closing quote"));
  CHECK_THAT(error_of(path, ""), Contains("no column 'tag'"));
  // A file saved by a spreadsheet can be read, but not continued.
  CHECK(error_of(path, "\xef\xbb\xbftag;found;percent_of_span\r\nF1;Air;4,5\r\n").empty());
  CHECK(read_outcomes(path).front().percent_of_span == 4.5);
  CHECK_THROWS_AS(keep_outcome(path, answer(valve_loop("F1", 4.0), AtValve::air)), CommandError);
  CHECK(read_outcomes(path).size() == 1);
}

TEST_CASE("a rejected finding is ranked below the others until its size has grown by half",
          "[outcome]") {
  const std::vector<FitterAnswer> rejected{answer(valve_loop("F1", 4.0), AtValve::nothing)};
  const auto first_of = [&](const json& loop) {
    const json survey =
        join_survey({loop, valve_loop("F2", 2.0, "stiction", "likely")}, json::array(), rejected);
    const json& again = survey["loops"][0]["tag"] == "F1" ? survey["loops"][0] : survey["loops"][1];
    CHECK(again["outcome"]["found"] == "nothing");
    CHECK(again["held_back"] == (survey["loops"][0]["tag"] == "F2"));
    CHECK((again["next"]["what"] == "nothing") == again["held_back"].get<bool>());
    return survey["loops"][0]["tag"].get<std::string>();
  };
  CHECK(first_of(valve_loop("F1", 4.0)) == "F2");
  CHECK(first_of(valve_loop("F1", 5.9)) == "F2");
  CHECK(first_of(valve_loop("F1", 6.0)) == "F1");
  CHECK(first_of(valve_loop("F1", 4.0, "backlash")) == "F1");
  // A confirmed finding is not suppressed.
  const json survey = join_survey({valve_loop("F1", 4.0)}, json::array(),
                                  {answer(valve_loop("F1", 4.0), AtValve::stiction)});
  CHECK(survey["loops"][0]["held_back"] == false);
  CHECK(survey["outcomes"]["precision"][0]["right"] == 1);
  const std::string csv = survey_csv(survey);
  CHECK_THAT(csv, Catch::Contains("next,found,held_back\n") && Catch::Contains(",stiction,0\n"));
}

TEST_CASE("seen effects are ranked before likely ones, and those before mere oscillation",
          "[survey]") {
  json likely = valve_loop("F1", 4.0, "stiction", "likely");
  likely["variability"] = 1.0;  // enough for a higher score
  json seen = valve_loop("F2", 4.0);
  seen["probability"] = 0.7;
  json held_back = valve_loop("F3", 2.0);
  json swings = caused_loop("F4", "disturbance", 0.5);
  const json survey = join_survey({swings, held_back, likely, seen}, json::array(),
                                  {answer(valve_loop("F3", 2.0), AtValve::nothing)});
  std::vector<std::string> tags;
  for (const json& loop : survey["loops"]) tags.push_back(loop["tag"]);
  CHECK(tags == std::vector<std::string>{"F2", "F1", "F4", "F3"});
  CHECK(survey["loops"][1]["score"] > survey["loops"][0]["score"]);
}

TEST_CASE("the site's own precision counts the named valve effects by grade", "[outcome]") {
  std::vector<FitterAnswer> answers;
  for (int k = 0; k < 9; ++k)
    answers.push_back(answer(valve_loop("A" + std::to_string(k), 3.0),
                             k < 7 ? AtValve::stiction : AtValve::nothing));
  answers.push_back(answer(valve_loop("B", 3.0, "hysteresis", "likely"), AtValve::backlash));
  answers.push_back(answer(valve_loop("C", 3.0, "low_air_supply", "likely"), AtValve::air));
  answers.push_back(
      answer(valve_loop("D", 3.0, "backlash", "likely"), AtValve::stiction));  // an alternative
  answers.push_back(answer(valve_loop("E", 3.0, "low_air_supply", "likely"), AtValve::other));
  answers.push_back(answer(survey_loop("F", "healthy"), AtValve::stiction));
  const json told = precision_json(answers);
  CHECK(told["answered"] == 14);
  CHECK(told["precision"][0]["grade"] == "seen");
  CHECK(told["precision"][0]["right"] == 7);
  CHECK(told["precision"][0]["of"] == 9);
  CHECK(told["precision"][0]["low_percent"] == 45.3);
  CHECK(told["precision"][0]["high_percent"] == 93.7);
  CHECK(told["precision"][1]["right"] == 3);
  CHECK(told["precision"][1]["of"] == 4);
  CHECK(precision_text(told) ==
        "14 answered by outcome; of the valve effects right: seen: 7 of 9 (45 to 94 %); likely: 3 "
        "of 4 "
        "(30 to 95 %)");
  CHECK(precision_text(precision_json({})).empty());
}

}  // namespace
}  // namespace loopwarden::tests::outcomes_test
