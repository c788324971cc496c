// SPDX-License-Identifier: Apache-2.0
// Runs loopwarden-study gap as a user does.
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::gap_study_test {
namespace {

namespace fs = std::filesystem;

ShellOutcome run_program(const std::string& call) {
  return bash(LOOPWARDEN_BIN_DIR "/" + call + " 2>/dev/null");
}

// A program that never finds a gap.
std::string blind_program(const TemporaryFolder& folder) {
  const fs::path path = folder / "blind";
  write_file(path,
             "#!/bin/sh\necho '{\"verdict\": \"no_gap\", \"effects\": [], \"gap\": {\"before\": "
             "{\"holdout_rmse\": 1}, \"after\": {\"holdout_rmse\": 1}}}' > \"$6/gap.json\"\n");
  fs::permissions(path, fs::perms::owner_all);
  return path.string();
}

}  // namespace

TEST_CASE("wrong usage of the study ends with 64, unreadable or unstartable input with 74",
          "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  const std::string gap = " --gap " + blind_program(folder);
  CHECK(run_program("loopwarden-study gap --help").exit_code == 0);
  CHECK(run_program("loopwarden-study gap" + gap).exit_code == 64);
  CHECK(run_program("loopwarden-study gap --generate 2" + gap).exit_code == 64);
  CHECK(run_program("loopwarden-study gap --cases " + out + gap).exit_code == 74);
  write_file(folder / "bad/truth.json", "[{}]");
  CHECK(run_program("loopwarden-study gap --cases " + (folder / "bad").string() + gap).exit_code ==
        65);
}

TEST_CASE("a refusal or failure of the generator ends the study", "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string study =
      "loopwarden-study gap --generate 2 --seed 9 --gap " + blind_program(folder);
  CHECK(run_program(study + " --kinds odd").exit_code == 64);
  const fs::path broken = folder / "broken";
  write_file(broken, "#!/bin/sh\nexit 3\n");
  fs::permissions(broken, fs::perms::owner_all);
  CHECK(run_program(study + " --generator " + broken.string()).exit_code == 74);
  write_file(folder / "no-program", "");
  CHECK(run_program(study + " --generator " + (folder / "no-program").string()).exit_code == 74);
}

TEST_CASE("written cases are scored, those with load separately", "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "some-load").string();
  REQUIRE(run_program("loopwarden_hidden_cases --count 3 --seed 9 --samples 600 --load --out " +
                      out + " --kinds none")
              .exit_code == 0);
  CHECK(nlohmann::json::parse(read_file(folder / "some-load/truth.json")).size() == 3);
  const ShellOutcome outcome =
      run_program("loopwarden-study gap --json --cases " + out + " --gap " + blind_program(folder));
  REQUIRE(outcome.exit_code == 0);
  const auto result = nlohmann::json::parse(outcome.text);
  CHECK_FALSE(result.contains("no_load"));
  CHECK(result.at("load").at("failures") == 0);
  CHECK(result.at("load").at("figures").at("none_named").at("of") == 3);
  CHECK(result.at("load").at("figures").at("none_named").at("hits") == 0);
}

TEST_CASE("the study passes options on to the program", "[hidden_cases]") {
  const TemporaryFolder folder;
  const fs::path picky = folder / "picky";
  write_file(picky, "#!/bin/sh\n[ \"$8\" = --without ] && [ \"$9\" = load ] || exit 64\nexec " +
                        blind_program(folder) + " \"$@\"\n");
  fs::permissions(picky, fs::perms::owner_all);
  const std::string study =
      "loopwarden-study gap --generate 2 --seed 9 --samples 600 --json --kinds none --gap " +
      picky.string();
  const auto failures = [](const std::string& call) {
    const ShellOutcome outcome = run_program(call);
    REQUIRE(outcome.exit_code == 0);
    return nlohmann::json::parse(outcome.text).at("no_load").at("failures").get<int>();
  };
  CHECK(failures(study) == 2);
  CHECK(failures(study + " --gap-option=--without --gap-option=load") == 0);
}

TEST_CASE("the whole study is one command", "[hidden_cases]") {
  const TemporaryFolder folder;
  const ShellOutcome outcome = run_program(
      "loopwarden-study gap --generate 4 --seed 9 --samples 600 --load --json "
      "--kinds single,outside --gap " +
      blind_program(folder));
  REQUIRE(outcome.exit_code == 0);
  const auto result = nlohmann::json::parse(outcome.text);
  for (const char* part : {"no_load", "load"}) {
    const auto& figures = result.at(part).at("figures");
    CHECK(figures.at("single_right").at("of") == 4);
    CHECK(figures.at("single_right").at("hits") == 0);
    CHECK(result.at(part).at("failures") == 0);
  }
}

}  // namespace loopwarden::tests::gap_study_test
