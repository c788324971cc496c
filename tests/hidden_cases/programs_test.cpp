// SPDX-License-Identifier: Apache-2.0
// The generator and the study as their users call them.
#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace programs_test {

using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

namespace {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code;
  std::string text;
};

Outcome run_program(const std::string& call) {
  FILE* pipe = popen((LOOPWARDEN_BIN_DIR "/" + call + " 2>/dev/null").c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::string text;
  std::array<char, 4096> buffer{};
  for (std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe); n > 0;
       n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    text.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

// A program that never sees a gap.
std::string blind_program(const TemporaryFolder& folder) {
  const fs::path path = folder / "blind";
  write_file(path,
             "#!/bin/sh\necho '{\"verdict\": \"no_gap\", \"effects\": [], \"gap\": {\"before\": "
             "{\"holdout_rmse\": 1}, \"after\": {\"holdout_rmse\": 1}}}' > \"$6/gap.json\"\n");
  fs::permissions(path, fs::perms::owner_all);
  return path.string();
}

}  // namespace

TEST_CASE("wrong usage ends with 64, what can't be read or started with 74", "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  CHECK(run_program("loopwarden_hidden_cases --help").exit_code == 0);
  CHECK(run_program("loopwarden_hidden_cases --out " + out).exit_code == 64);
  CHECK(run_program("loopwarden_hidden_cases --out " + out + " --seed 1 --kinds odd").exit_code ==
        64);
  CHECK(run_program("loopwarden_hidden_cases --out /proc/none --seed 1 --count 1").exit_code == 74);
  const std::string gap = " --gap " + blind_program(folder);
  CHECK(run_program("loopwarden_gap_study --help").exit_code == 0);
  CHECK(run_program("loopwarden_gap_study" + gap).exit_code == 64);
  CHECK(run_program("loopwarden_gap_study --generate 2" + gap).exit_code == 64);
  CHECK(run_program("loopwarden_gap_study --cases " + out + gap).exit_code == 74);
  write_file(folder / "bad/truth.json", "[{}]");
  CHECK(run_program("loopwarden_gap_study --cases " + (folder / "bad").string() + gap).exit_code ==
        65);
}

TEST_CASE("written cases are scored, those with load apart", "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "some-load").string();
  REQUIRE(run_program("loopwarden_hidden_cases --count 3 --seed 9 --samples 600 --load --out " +
                      out + " --kinds none")
              .exit_code == 0);
  CHECK(nlohmann::json::parse(read_file(folder / "some-load/truth.json")).size() == 3);
  const Outcome outcome =
      run_program("loopwarden_gap_study --json --cases " + out + " --gap " + blind_program(folder));
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
      "loopwarden_gap_study --generate 2 --seed 9 --samples 600 --json --kinds none --gap " +
      picky.string();
  const auto failures = [](const std::string& call) {
    const Outcome outcome = run_program(call);
    REQUIRE(outcome.exit_code == 0);
    return nlohmann::json::parse(outcome.text).at("no_load").at("failures").get<int>();
  };
  CHECK(failures(study) == 2);
  CHECK(failures(study + " --gap-option=--without --gap-option=load") == 0);
}

TEST_CASE("the whole study is one command", "[hidden_cases]") {
  const TemporaryFolder folder;
  const Outcome outcome = run_program(
      "loopwarden_gap_study --generate 4 --seed 9 --samples 600 --load --json "
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

}  // namespace programs_test
