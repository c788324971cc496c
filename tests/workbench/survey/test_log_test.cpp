// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/test_log.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench::test_log_test {

TEST_CASE("tests are kept next to a survey, and scored by tenths of the prediction") {
  const tests::TemporaryFolder folder;
  const auto path = folder / "tests.csv";
  CHECK(read_tests(path).empty());
  KeptTest test{.ended = "2026-11-29T00:42:20Z",
                .loop = "FIC-101",
                .explanations = "stiction, backlash or creep",
                .predicted = 0.92,
                .decided = "stiction",
                .probability = 0.99};
  keep_test(path, test);
  test.decided.clear();
  test.probability = 0.0;
  keep_test(path, test);
  test.predicted = 1.0;
  keep_test(path, test);
  test.predicted = 0.55;
  keep_test(path, test);
  const std::vector<KeptTest> kept = read_tests(path);
  REQUIRE(kept.size() == 4);
  CHECK(kept[0].explanations == "stiction, backlash or creep");
  CHECK(kept[0].decided == "stiction");
  CHECK(kept[1].decided.empty());
  const std::vector<ScoreOfTenth> score = score_of(kept);
  REQUIRE(score.size() == 2);
  CHECK(score[0].tests == 1);
  CHECK(score[1].tests == 3);
  CHECK(score[1].decided == 1);
  CHECK(score[1].predicted == Approx((0.92 + 0.92 + 1.0) / 3.0));
  CHECK(tests_text(kept).find("1 of 3 tests decided") != std::string::npos);
  CHECK(tests_text({}) == "no tests yet\n");

  tests::write_file(path, tests::read_file(path) + "x,y,z,2,,0\n");
  CHECK_THROWS_AS(read_tests(path), CommandError);
}

TEST_CASE("a survey lists the tests of each loop") {
  const tests::TemporaryFolder folder;
  const auto loop = [](const char* tag) {
    return nlohmann::json{{"tag", tag},
                          {"verdict", "cant_tell"},
                          {"rank", 1},
                          {"effects", nlohmann::json::array()},
                          {"next", nlohmann::json::object()},
                          {"windows", nlohmann::json::array()},
                          {"import", nlohmann::json::object()}};
  };
  const nlohmann::json survey{{"loops", {loop("FIC-101"), loop("FIC-102")}}};
  tests::write_file(folder / "survey.json", survey.dump());
  const KeptTest test{.ended = "2026-11-29T00:42:20Z",
                      .loop = "FIC-101",
                      .explanations = "stiction or backlash",
                      .predicted = 0.92,
                      .decided = "stiction",
                      .probability = 0.99};
  keep_test_of_survey(folder.path(), test);
  keep_test_of_survey(folder.path(), test);
  const auto loops = nlohmann::json::parse(tests::read_file(folder / "survey.json")).at("loops");
  REQUIRE(loops[0].at("tests").size() == 2);
  CHECK(loops[0].at("tests")[1].at("decided") == "stiction");
  CHECK(loops[0].at("rank") == 1);
  CHECK(loops[1].at("tests").empty());
  // Without a survey, only the log is kept.
  const tests::TemporaryFolder other;
  keep_test_of_survey(other.path(), test);
  CHECK(read_tests(other / kTestsFile).size() == 1);
  CHECK_FALSE(std::filesystem::exists(other / "survey.json"));
}

}  // namespace loopwarden::workbench::test_log_test
