// SPDX-License-Identifier: Apache-2.0
// Receipts of work at a valve, from files.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::receipt_test {
namespace {

using Catch::Contains;
using nlohmann::json;

// A loop at 1 s. `s`: band of the sticking valve; `load`: intensity of the disturbance.
void simulate(const TemporaryFolder& folder, const std::string& name, double s, double load,
              int seed, const std::string& set_points,
              const std::string& gains = "kp: 1.0, ki: 0.12") {
  write_file(folder / "m.yaml",
             "sample_time: 1.0\n"
             "controller: {" +
                 gains +
                 ", output: [0, 100]}\n"
                 "valve:\n  effects:\n    - {effect: stiction, s: " +
                 std::to_string(s) + ", j: " + std::to_string(0.4 * s) +
                 "}\n"
                 "process: {gain: 0.36, time_constant: 4.0, dead_time: 2.0}\n"
                 "transmitter: {range: [0, 40], resolution: 0.001, noise: 0.04}\n"
                 "disturbances:\n  - {effect: random_load, intensity: " +
                 std::to_string(load) +
                 ", time_constant: 200}\n"
                 "scenario: {duration: 5400, set_point: " +
                 set_points + ", seed: " + std::to_string(seed) + "}\n");
  const ShellOutcome made = run(LOOPWARDEN_CLI " simulate " + (folder / "m.yaml").string() +
                                " --out " + (folder / name).string() + " 2>&1");
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
}

ShellOutcome receipt(const TemporaryFolder& folder, const std::string& arguments) {
  return run("cd " + folder.path().string() + " && " LOOPWARDEN_CLI " receipt " + arguments +
             " 2>&1");
}

TEST_CASE("a receipt says whether the valve was repaired", "[receipt][program]") {
  const TemporaryFolder folder;
  simulate(folder, "before.csv", 5.0, 0.02, 1, "[[0, 18], [900, 20], [2700, 17], [4000, 19]]");
  simulate(folder, "good.csv", 0.1, 0.02, 2, "[[0, 22], [800, 24], [2000, 21], [4100, 23]]");
  simulate(folder, "same.csv", 5.0, 0.02, 3, "[[0, 22], [800, 24], [2000, 21], [4100, 23]]");
  const ShellOutcome good = receipt(
      folder, "FIC101 --before before.csv --after good.csv --found stiction --json --out r.html");
  INFO(good.text);
  REQUIRE(good.exit_code == 0);
  const json told = json::parse(good.text);
  CHECK(told["result"] == "repaired");
  CHECK(told["before"]["band_percent"].get<double>() == Approx(5.0).epsilon(0.4));
  CHECK(told["after"]["band_percent"].is_null());
  CHECK(told["after"]["rms"] < told["before"]["rms"]);
  CHECK(told["after"]["reversals_per_hour"].is_number());
  CHECK(told["same_disturbance"] == true);
  CHECK(told["saving"]["high"] > 0);
  const std::string page = read_file(folder / "r.html");
  CHECK_THAT(page, Contains("FIC101: repaired.") && Contains("size: A4") && Contains("<svg"));
  CHECK(page.find("src=") == std::string::npos);
  CHECK(page.find("href=") == std::string::npos);
  const ShellOutcome same = receipt(folder, "FIC101 --before before.csv --after same.csv");
  INFO(same.text);
  CHECK(same.exit_code == 0);
  CHECK_THAT(same.text, Contains("FIC101: NOT repaired. The valve still shows the effect.") &&
                            Contains("Saving: not stated."));
  // Records of some minutes decide nothing.
  const std::string text = read_file(folder / "good.csv");
  std::size_t end = 0;
  for (int line = 0; line < 1200; ++line) end = text.find('\n', end) + 1;
  write_file(folder / "short.csv", text.substr(0, end));
  CHECK_THAT(
      receipt(folder, "--before before.csv --after short.csv").text,
      Contains("can't tell. The record after the work has 20 min, and 30 min are needed: wait, or "
               "export a longer record."));
  // A sample per minute is too few.
  std::string sparse = text.substr(0, text.find('\n') + 1);
  std::size_t at = sparse.size();
  for (int line = 0; at < text.size(); ++line) {
    const std::size_t next = text.find('\n', at) + 1;
    if (line % 60 == 0) sparse += text.substr(at, next - at);
    at = next;
  }
  write_file(folder / "sparse.csv", sparse);
  CHECK_THAT(receipt(folder, "--before before.csv --after sparse.csv").text,
             Contains("The record after the work has 91 samples of PV and CO in a row in "
                      "automatic, and 100 are needed: export a longer record"));
  // Without a fault before, there is nothing to repair.
  CHECK_THAT(receipt(folder, "--before good.csv --after good.csv").text,
             Contains("can't tell. The record before the work shows no valve effect"));
  CHECK(receipt(folder, "--before before.csv").exit_code == 64);
  CHECK(receipt(folder, "").exit_code == 64);
  CHECK(receipt(folder, "--before before.csv --after none.csv").exit_code == 74);
}

TEST_CASE("a receipt doubts records of another loop or unit", "[receipt][program]") {
  const TemporaryFolder folder;
  const auto record = [&](const char* name, double factor) {
    std::string text = "time,pv,co\n";
    for (int k = 0; k < 3600; ++k) {
      text += std::to_string(k) + "," + std::to_string(factor * (10 + k / 9 % 3)) + "," +
              std::to_string(50 + k / 7 % 5) + "\n";
    }
    write_file(folder / name, text);
  };
  record("before.csv", 1.0);
  record("litres.csv", 16.7);
  const std::string doubt =
      "Warning: PV is 10 to 12 before and 167 to 200 after. Are both "
      "records of the same loop, in the same units?";
  CHECK_THAT(receipt(folder, "--before before.csv --after litres.csv --out r.html").text,
             Contains(doubt));
  CHECK_THAT(read_file(folder / "r.html"), Contains(doubt));
  const ShellOutcome same = receipt(folder, "--before before.csv --after before.csv");
  CHECK(same.exit_code == 0);
  CHECK_THAT(same.text, !Contains("Warning"));
}

TEST_CASE("another disturbance after the work forbids a saving", "[receipt][program]") {
  const TemporaryFolder folder;
  const std::string set_points = "[[0, 18], [900, 20], [2700, 17], [4000, 19]]";
  simulate(folder, "before.csv", 5.0, 0.02, 1, set_points);
  simulate(folder, "after.csv", 0.1, 0.2, 2, set_points);
  const ShellOutcome told = receipt(folder, "--before before.csv --after after.csv --json");
  INFO(told.text);
  REQUIRE(told.exit_code == 0);
  const json said = json::parse(told.text);
  CHECK(said["same_disturbance"] == false);
  CHECK(said["saving"].is_null());
}

TEST_CASE("new gains are compared on the same disturbance by the model", "[receipt][program]") {
  const TemporaryFolder folder;
  const std::string set_points = "[[0, 18], [900, 20], [2700, 17], [4000, 19]]";
  simulate(folder, "slow.csv", 0.1, 0.02, 1, set_points, "kp: 0.4, ki: 0.02");
  // The disturbance after the change is smaller.
  simulate(folder, "calm.csv", 0.1, 0.005, 2, set_points, "kp: 0.4, ki: 0.02");
  simulate(folder, "fast.csv", 0.1, 0.02, 3, set_points, "kp: 1.0, ki: 0.12");
  const std::string slow = " --gains-before 0.4 0.02 0 ";
  const std::string fast = slow + "--gains-after 1.0 0.12 0 ";
  const auto result = [&](const std::string& arguments) {
    const ShellOutcome told = receipt(folder, arguments + " --json");
    INFO(told.text);
    REQUIRE(told.exit_code == 0);
    return json::parse(told.text);
  };
  const json better = result("F --before slow.csv --after fast.csv --model m.yaml" + fast);
  CHECK(better["result"] == "improved");
  CHECK(better["before"]["by_model"][1] < better["before"]["by_model"][0]);
  const json same = result("F --before slow.csv --after calm.csv --model m.yaml" + slow +
                           "--gains-after 0.4 0.02 0");
  CHECK(same["after"]["rms"] < same["before"]["rms"]);
  CHECK(same["result"] == "no_difference");
  CHECK(result("F --before fast.csv --after slow.csv --model m.yaml --gains-before 1.0 0.12 0 "
               "--gains-after 0.4 0.02 0")["result"] == "worse");
  // Without a model another disturbance can be the cause.
  CHECK(result("F --before slow.csv --after fast.csv" + fast)["result"] == "cant_tell");
}

TEST_CASE("a repair is recorded with its fault", "[receipt][program]") {
  CHECK(run(LOOPWARDEN_CLI " outcome FIC1 --repaired 2>&1").exit_code == 64);
  CHECK(run(LOOPWARDEN_CLI " outcome FIC1 --found nothing --repaired 2>&1").exit_code == 64);
}

}  // namespace
}  // namespace loopwarden::tests::receipt_test
