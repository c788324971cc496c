// SPDX-License-Identifier: Apache-2.0
// The workbench as its users call it.
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <unistd.h>
#include <nlohmann/json.hpp>
#include <string>

#include "record/record_csv.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::programs_test {
namespace {

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

const std::string kModel = LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml";

TEST_CASE("help and version end with 0, wrong usage with 64") {
  CHECK(loopwarden("--help").exit_code == 0);
  CHECK(loopwarden("simulate --help").text.find("Example:") != std::string::npos);
  CHECK(loopwarden("--version").exit_code == 0);
  CHECK(loopwarden("").exit_code == 64);
  CHECK(loopwarden("dance").exit_code == 64);
  CHECK(loopwarden("simulate").exit_code == 64);
  CHECK(loopwarden("set FIC-101").exit_code == 64);
}

TEST_CASE("simulate writes a record that reads back, the same for the same seed") {
  const TemporaryFolder folder;
  const auto simulated = [&](const std::string& name, int seed) {
    const std::string file = (folder / name).string();
    const ShellOutcome outcome = loopwarden("simulate " + kModel + " --duration 100 --seed " +
                                            std::to_string(seed) + " --out " + file);
    INFO(outcome.text);
    CHECK(outcome.exit_code == 0);
    return read_file(file);
  };
  const std::string first = simulated("a.csv", 1);
  CHECK(first == simulated("b.csv", 1));
  CHECK(first != simulated("c.csv", 2));
  const record::Record record = record::read_record(folder / "a.csv");
  CHECK(record.size() == 1001);
  CHECK(!record.sp.empty());
  CHECK(!record.co.empty());
  CHECK(!record.stem.empty());
}

TEST_CASE(
    "simulate prints JSON, and refuses a model with errors and a place that can't be written") {
  const TemporaryFolder folder;
  const ShellOutcome good = loopwarden("simulate " + kModel + " --duration 10 --json --out " +
                                       (folder / "a.csv").string());
  CHECK(nlohmann::json::parse(good.text).at("samples") == 101);
  write_file(folder / "bad.yaml", "sample_time: -1\n");
  const ShellOutcome bad = loopwarden("simulate " + (folder / "bad.yaml").string() + " --out " +
                                      (folder / "b.csv").string());
  CHECK(bad.exit_code == 78);
  CHECK(bad.text.find("bad.yaml:1:") != std::string::npos);
  CHECK(loopwarden("simulate " + kModel + " --duration 10 --out /nonexistent/x.csv").exit_code ==
        74);
}

TEST_CASE("check reports every error of every file and ends with 78") {
  const TemporaryFolder folder;
  write_file(folder / "model.yaml", "sample_time: 0.1\nprocess: {gian: 1}\n");
  write_file(folder / "loop.yaml", "loop: FIC-101\nsample_time: none\n");
  const ShellOutcome outcome =
      loopwarden("check " + kModel + " " + (folder / "model.yaml").string() + " " +
                 (folder / "loop.yaml").string());
  CHECK(outcome.exit_code == 78);
  CHECK(outcome.text.find("plant1.yaml: ok") != std::string::npos);
  CHECK(outcome.text.find("did you mean 'gain'") != std::string::npos);
  CHECK(outcome.text.find("loop.yaml:2:") != std::string::npos);
}

TEST_CASE("check accepts the example configurations") {
  const std::string examples = LOOPWARDEN_SOURCE_DIR "/examples/";
  const std::string name =
      GENERATE(as<std::string>(), "demo", "simulated", "modbus-tcp", "modbus-plc", "modbus-rtu",
               "analog", "replay", "watch", "watch-mqtt", "opcua");
  const ShellOutcome outcome = loopwarden("check " + examples + name);
  INFO(outcome.text);
  CHECK(outcome.exit_code == 0);
}

TEST_CASE("effects prints the catalogue, and writes it with pictures") {
  const TemporaryFolder folder;
  const ShellOutcome outcome = loopwarden("effects --json --out " + folder.path().string());
  CHECK(outcome.exit_code == 0);
  const nlohmann::json effects = nlohmann::json::parse(outcome.text);
  CHECK(effects.front().at("name") == "stiction");
  CHECK(effects.front().at("parameters").at(0).at("unit") == "CO units");
  CHECK(effects.back().at("name") == "controller_mismatch");
  CHECK(read_file(folder / "effects.md").starts_with("# Effects"));
  CHECK(read_file(folder / "pictures/effects/stiction.svg").starts_with("<svg"));
  CHECK(loopwarden("effects --out " + (folder / "effects.md/x").string()).exit_code == 74);
}

TEST_CASE("gap uses a part of a record and shows its command in its report") {
  const TemporaryFolder folder;
  const std::string record = (folder / "record.csv").string();
  const std::string out = (folder / "out").string();
  REQUIRE(loopwarden("simulate " + kModel + " --duration 200 --out " + record).exit_code == 0);
  const std::string gap = "gap " + record + " --model " + kModel + " --out " + out;
  const ShellOutcome found =
      loopwarden(gap + " --from 20 --to 110 --largest-load 0.2 --without several");
  INFO(found.text);
  CHECK(found.exit_code == 0);
  CHECK(found.text.find("Times count from 20 s of the record.") != std::string::npos);
  CHECK(nlohmann::json::parse(read_file(folder / "out/gap.json")).contains("verdict"));
  const std::string report = read_file(folder / "out/report.html");
  CHECK(report.find("--from 20 --to 110 --largest-load 0.2 --without several") !=
        std::string::npos);
  CHECK(loopwarden("check " + out + "/model.corrected.yaml").exit_code == 0);
  const ShellOutcome beyond = loopwarden(gap + " --from 900");
  CHECK(beyond.exit_code == 65);
  CHECK(beyond.text.find("no samples from 900 s on; the record runs from 0 s to 200 s") !=
        std::string::npos);
}

TEST_CASE("gap refuses an uninformative record, with the reason as a page; old results stay") {
  const TemporaryFolder folder;
  std::string frozen = "time,sp,pv,co\n";
  for (int k = 0; k < 2000; ++k) frozen += std::to_string(k) + ",5,5,5\n";
  write_file(folder / "frozen.csv", frozen);
  const std::string out = (folder / "out").string();
  const std::string gap =
      "gap " + (folder / "frozen.csv").string() + " --model " + kModel + " --out " + out;
  const ShellOutcome refused = loopwarden(gap);
  CHECK(refused.exit_code == 65);
  CHECK(refused.text.find("frozen.csv") != std::string::npos);
  CHECK(read_file(folder / "out/report.html").find("Record refused") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "out/gap.json"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/model.corrected.yaml"));

  for (const char* name : {"gap.json", "model.corrected.yaml", "report.html"}) {
    write_file(folder / "out" / name, "of an earlier run");
  }
  const ShellOutcome again = loopwarden(gap);
  CHECK(again.exit_code == 65);
  CHECK(again.text.find("results of an earlier run, unchanged") != std::string::npos);
  for (const char* name : {"gap.json", "model.corrected.yaml", "report.html"}) {
    CHECK(read_file(folder / "out" / name) == "of an earlier run");
  }
  const auto in_out = std::filesystem::directory_iterator(folder / "out");
  CHECK(std::distance(begin(in_out), end(in_out)) == 3);
}

TEST_CASE("without a daemon, top and set report it and end with 74") {
  const ShellOutcome top = loopwarden("top --once --socket /nonexistent.sock");
  CHECK(top.exit_code == 74);
  CHECK(top.text.find("no daemon answers at /nonexistent.sock") != std::string::npos);
  CHECK(loopwarden("set FIC-101 --sp 5 --socket /nonexistent.sock").exit_code == 74);
}

TEST_CASE(
    "without permission for the socket, the group and the command that adds the user are named") {
  const TemporaryFolder folder;
  const std::filesystem::path closed = folder / "closed";
  std::filesystem::create_directory(closed);
  std::filesystem::permissions(closed, std::filesystem::perms::none);
  // Root may always connect.
  const std::string as_user =
      ::geteuid() == 0 ? "setpriv --reuid=65534 --regid=65534 --clear-groups " : "";
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  const auto top = [&](const char* socket) {
    return run(as_user + LOOPWARDEN_CLI " top --once --socket " + (closed / socket).string() +
               " 2>&1");
  };
  const ShellOutcome control = top("control.sock");
  CHECK(control.exit_code == 74);
  CHECK_THAT(control.text, Catch::Contains(" loopwardend`, then log in again"));
  CHECK_THAT(control.text, Catch::Contains("sudo adduser"));
  CHECK_THAT(top("status.sock").text, Catch::Contains("group loopwarden-status have it"));
  std::filesystem::permissions(closed, std::filesystem::perms(0700));
}

}  // namespace
}  // namespace loopwarden::tests::programs_test
