// SPDX-License-Identifier: Apache-2.0
// Runs `loopwarden-study diagnose` as a user does: weights, comparison, gap examples.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "lab/hidden_cases/hidden_case.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace diagnose_study_test {

using loopwarden::tests::bash;
using loopwarden::tests::ShellOutcome;
using loopwarden::tests::TemporaryFolder;

const std::string kStudy = LOOPWARDEN_BIN_DIR "/loopwarden-study diagnose ";

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST_CASE("--weights: the same simulated loops give the same weights, others give others",
          "[studies][diagnose]") {
  const auto weights = [](const std::string& seed) {
    const ShellOutcome outcome = bash(kStudy + "--cases 60 --weights --seed " + seed);
    REQUIRE(outcome.exit_code == 0);
    return outcome.text;
  };
  const std::string first = weights("5");
  CHECK(first.find("kPerNat") != std::string::npos);
  CHECK(first == weights("5"));
  CHECK(first != weights("6"));
}

TEST_CASE("--compare: measured and simulated loops, with and without an ingredient",
          "[studies][diagnose]") {
  const TemporaryFolder folder;
  const std::string data = LOOPWARDEN_SOURCE_DIR "/examples/";
  const std::string compare =
      "--records " + data + "isdb " + data + "routine --cases 100 --seed 3 --compare ";
  const ShellOutcome outcome =
      bash(kStudy + compare + "--evidence " + (folder / "all.csv").string());
  REQUIRE(outcome.exit_code == 0);
  const std::size_t table = outcome.text.find("all evidence together");
  REQUIRE(table != std::string::npos);
  const std::string rows = outcome.text.substr(table);
  CHECK(rows.find("\nflow ") != std::string::npos);
  CHECK(rows.find("\nall ") != std::string::npos);
  CHECK(rows.find("CHEM") != std::string::npos);
  CHECK(rows.find("routine") != std::string::npos);
  const std::string evidence = text_of(folder / "all.csv");
  CHECK(evidence.find("\nsimulated,") != std::string::npos);
  CHECK(evidence.find("\nCHEM,CHEM1,flow,1,") != std::string::npos);

  const ShellOutcome bare = bash(kStudy + compare + "--without all --with steps");
  CHECK(bare.exit_code == 0);
  CHECK(bare.text != outcome.text);
  CHECK(bash(kStudy + compare + "--without nonsense 2>/dev/null").exit_code == 64);
}

TEST_CASE(
    "--gap-examples: found and false alarms are counted, a bias is none, a bad list is reported",
    "[studies][diagnose]") {
  const TemporaryFolder folder;
  std::vector<loopwarden::hidden_cases::CaseRequest> requests{
      {.id = "stuck", .effect = "stiction", .seed = 60031},
      {.id = "bias", .effect = "output_bias", .seed = 60005}};
  loopwarden::hidden_cases::write_cases(folder / "cases", requests);
  const ShellOutcome outcome = bash(kStudy + "--gap-examples " + (folder / "cases").string());
  CHECK(outcome.exit_code == 0);
  INFO(outcome.text);
  CHECK_THAT(outcome.text, Catch::Contains(" of 1; false alarms 0 of 1"));

  std::ofstream(folder / "cases" / "truth.json") << R"([{"id": "stuck"}])";
  const ShellOutcome bad = bash(kStudy + "--gap-examples " + (folder / "cases").string() + " 2>&1");
  CHECK(bad.exit_code == 65);
  CHECK(bad.text.find("truth.json: not a list of truths") != std::string::npos);
}

}  // namespace diagnose_study_test
