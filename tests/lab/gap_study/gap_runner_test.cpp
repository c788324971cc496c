// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/gap_runner.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>
#include <system_error>

#include "tests/support/temporary_folder.hpp"

namespace gap_runner_test {

using namespace loopwarden::lab::gap_study;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

namespace {

namespace fs = std::filesystem;

// A substitute for the program: called as `PATH gap RECORD --model MODEL --out OUT --json`.
GapProgram script(const TemporaryFolder& folder, const std::string& body) {
  const fs::path path = folder / "program";
  write_file(path, "#!/bin/sh\n" + body);
  fs::permissions(path, fs::perms::owner_all);
  return {.path = path};
}

constexpr const char* kNoGap =
    R"({"verdict": "no_gap", "effects": [], "gap": {"before": {}, "after": {}}, "candidates": []})";

void write_two_cases(const fs::path& folder) {
  write_file(folder / "truth.json",
             R"([{"id": "a", "effect": "none", "accept": ["none"], "par": {}, "floor_rmse": 0.1},
                 {"id": "b", "effect": "drift", "accept": ["drift"], )"
             R"("par": {}, "floor_rmse": 0.1}])");
}

}  // namespace

TEST_CASE("the program gets record, model and a folder; its gap.json is the answer",
          "[hidden_cases]") {
  const TemporaryFolder folder;
  const GapProgram program = script(folder, std::string(R"(
    [ "$1" = gap ] && [ "$2" = CASE/record.csv ] && [ "$3" = --model ] &&
    [ "$4" = CASE/model.yaml ] && [ "$5" = --out ] && [ "$7" = --json ] || exit 64
    echo ')") + kNoGap + "' > \"$6/gap.json\"\n");
  const Answer answer = run_gap(program, "CASE", folder / "out");
  CHECK(answer.failure == "");
  CHECK(answer.verdict == "no_gap");
  CHECK(answer.seconds > 0.0);
}

TEST_CASE("further options are passed on as they are", "[hidden_cases]") {
  const TemporaryFolder folder;
  GapProgram program =
      script(folder, std::string("[ \"$8\" = --without ] && [ \"$9\" = 'two words' ] && [ $# = 9 ] "
                                 "|| exit 64\necho '") +
                         kNoGap + "' > \"$6/gap.json\"\n");
  CHECK(run_gap(program, "c", folder / "out").failure == "exit code 64: ");
  program.options = {"--without", "two words"};
  CHECK(run_gap(program, "c", folder / "out").failure == "");
}

TEST_CASE("a program that fails is an answer with the reason", "[hidden_cases]") {
  const TemporaryFolder folder;
  CHECK(run_gap(script(folder, "echo frozen PV >&2; exit 65\n"), "c", folder / "out").failure ==
        "exit code 65: frozen PV");
  CHECK(run_gap(script(folder, "kill -9 $$\n"), "c", folder / "out").failure == "signal 9");
  CHECK(run_gap(script(folder, "exit 0\n"), "c", folder / "out").failure.find("gap.json") !=
        std::string::npos);
  GapProgram slow = script(folder, "exec sleep 60\n");
  slow.time_limit_s = 0.05;
  CHECK(run_gap(slow, "c", folder / "out").failure == "time limit");
  CHECK_THROWS_AS(run_gap({.path = folder / "absent"}, "c", folder / "out"), std::system_error);
}

TEST_CASE("cases are found by folder or by file", "[hidden_cases]") {
  const TemporaryFolder folder;
  write_two_cases(folder.path());
  CHECK(find_cases(folder.path()).size() == 2);
  const auto alone = find_cases(folder / "b/");
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].truth.effect == "drift");
  CHECK_THROWS_AS(find_cases(folder / "c"), std::runtime_error);
  CHECK_THROWS_AS(find_cases(folder / "c/d"), std::system_error);
}

TEST_CASE("all cases are scored in their order, with any number at a time", "[hidden_cases]") {
  const TemporaryFolder folder;
  write_two_cases(folder.path());
  const GapProgram program =
      script(folder, std::string("echo '") + kNoGap + "' > \"$6/gap.json\"\n");
  const unsigned jobs = GENERATE(1U, 3U);
  std::size_t last = 0;
  const auto scored = run_cases(program, find_cases(folder.path()), folder / "out", jobs,
                                [&](std::size_t done) { last = done; });
  CHECK(last == 2);
  REQUIRE(scored.size() == 2);
  CHECK(scored[0].truth.id == "a");
  CHECK(scored[0].score.right);
  CHECK(scored[1].truth.id == "b");
  CHECK_FALSE(scored[1].score.right);
}

}  // namespace gap_runner_test
