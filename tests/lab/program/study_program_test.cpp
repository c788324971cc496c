// SPDX-License-Identifier: Apache-2.0
// The common behaviour of all studies, and that each runs.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::study_program_test {
namespace {

const std::string kProgram = LOOPWARDEN_BIN_DIR "/loopwarden-study";
const std::string kSource = LOOPWARDEN_SOURCE_DIR;

ShellOutcome study(const std::string& words) { return bash(kProgram + " " + words + " 2>&1"); }

}  // namespace

TEST_CASE("every study prints JSON on request, and has help") {
  for (const char* name :
       {"alarm", "calm", "compare", "diagnose", "gallery", "gap", "plant1", "specialist"}) {
    INFO(name);
    const ShellOutcome help = study(std::string(name) + " --help");
    CHECK(help.exit_code == 0);
    CHECK(help.text.find("--json") != std::string::npos);
    CHECK(help.text.find("Example: loopwarden-study " + std::string(name)) != std::string::npos);
  }
  for (const std::string& words :
       {std::string("diagnose --cases 1"),
        "alarm --specialists " + kSource +
            "/examples/specialists/plant1 --runs 1 --windows 3 --days 0"}) {
    INFO(words);
    const ShellOutcome outcome = bash(kProgram + " " + words + " --json 2>/dev/null");
    CHECK(outcome.exit_code == 0);
    const nlohmann::json value = nlohmann::json::parse(outcome.text, nullptr, false);
    CHECK((value.is_object() || value.is_array()));
  }
}

TEST_CASE("a study's seed is not negative, and an unknown study is named with the nearest") {
  for (const char* name : {"alarm", "calm", "diagnose", "plant1", "specialist"}) {
    INFO(name);
    const ShellOutcome outcome = study(std::string(name) + " --seed -1");
    CHECK(outcome.exit_code == 64);
    CHECK(outcome.text.find("must not be negative (got -1)") != std::string::npos);
  }
  const ShellOutcome unknown = study("callm");
  CHECK(unknown.exit_code == 64);
  CHECK(unknown.text.find("loopwarden-study: unknown command") != std::string::npos);
  CHECK(unknown.text.find("calm") != std::string::npos);
}

TEST_CASE("every open record gets a verdict: no healthy loop is accused, sticky ones are found") {
  const ShellOutcome outcome =
      study("diagnose --records " + kSource + "/examples/routine " + kSource + "/examples/isdb");
  INFO(outcome.text);
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.text.find("r27.csv") != std::string::npos);
  for (const char* line : {"windows right, as answered ", "windows right, of the decided ",
                           "loops right, as answered ", "AUC by loop, log odds "}) {
    CHECK(outcome.text.find(line) != std::string::npos);
  }
  CHECK(study("diagnose --records /nonexistent").exit_code == 74);
}

TEST_CASE("the gallery names the measured record that it does not find") {
  const ShellOutcome outcome = study("gallery --data /nonexistent");
  CHECK(outcome.exit_code == 74);
  CHECK(outcome.text.find("/nonexistent/measured/rse_0412_fcv701.csv") != std::string::npos);
}

TEST_CASE("the study of specialists runs on the shipped ones") {
  const ShellOutcome outcome =
      study("specialist table real unknown --quick --data " + kSource +
            "/examples/specialists --records " + kSource + "/examples/plant1");
  INFO(outcome.text);
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.text.find("Table 9.1 with 9 specialists: 2") != std::string::npos);
  CHECK(outcome.text.find("P1H16") != std::string::npos);
  CHECK(outcome.text.find("called a valve fault") != std::string::npos);
  CHECK(study("specialist nothing").exit_code == 64);
}

TEST_CASE("SIGTERM removes a study's new folder", "[long]") {
  const TemporaryFolder folder;
  const std::string cases = (folder / "cases").string();
  // Ended once the first case exists there.
  const ShellOutcome outcome =
      bash(kProgram + " diagnose --cases 100000 --save " + cases +
           " 2>/dev/null & study=$!; for i in $(seq 3000); do [ -n \"$(ls " + cases +
           " 2>/dev/null)\" ] && break; sleep 0.01; done; kill -TERM $study; wait $study; "
           "echo $?; ls " +
           cases + " 2>&1 | grep -c \"cannot access\"");
  CHECK(outcome.text == "143\n1\n");
}

}  // namespace loopwarden::tests::study_program_test
