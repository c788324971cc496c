// SPDX-License-Identifier: Apache-2.0
// `loopwarden commission` and the commands that use its twin, as users call them.
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::commission_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

std::string model_text(double gain, const std::string& scenario) {
  return "sample_time: 0.1\n"
         "controller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
         "process: {gain: " +
         std::to_string(gain) +
         ", time_constant: 1.5, dead_time: 0.6}\n"
         "transmitter: {range: [0, 10], resolution: 0.0025, noise: 0.015}\n"
         "scenario: {" +
         scenario + "}\n";
}

struct Bench {
  explicit Bench(const std::string& scenario, double believed_gain = 1.35) {
    write_file(folder / "truth.yaml", model_text(1.0, scenario));
    write_file(folder / "rough.yaml", model_text(believed_gain, scenario));
    const ShellOutcome simulated =
        loopwarden("simulate " + path("truth.yaml") + " --out " + path("record.csv"));
    INFO(simulated.text);
    REQUIRE(simulated.exit_code == 0);
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  json commissioned(const std::string& options) const {
    const ShellOutcome out =
        loopwarden("commission " + path("record.csv") + " --out " + path("out") + " " + options);
    INFO(out.text);
    REQUIRE(out.exit_code == 0);
    return json::parse(read_file(folder / "out" / "commission.json"));
  }
  TemporaryFolder folder;
};

}  // namespace

TEST_CASE("a short record is commissioned when it is accepted, and check and replay take the twin",
          "[commission][long]") {
  const Bench bench(
      "duration: 300, set_point: [[0, 3], [20, 5], [60, 6.5], [100, 4], [140, 5.5], [200, 3.5]]");
  const json refused = bench.commissioned("--model " + bench.path("rough.yaml"));
  CHECK(refused.at("verdict") == "not_enough_movement");
  CHECK(refused.at("twin").is_null());
  CHECK(!fs::exists(bench.folder / "out" / "twin.yaml"));
  CHECK(read_file(bench.folder / "out" / "report.html").find("<b>not enough movement</b>") !=
        std::string::npos);

  const json made =
      bench.commissioned("--accept-short --windows 700 --model " + bench.path("rough.yaml"));
  INFO(made.dump(1));
  CHECK(made.at("verdict") == "commissioned");
  CHECK(made.at("accepted") == json::array({"short"}));
  CHECK(made.at("gap").at("closed").get<double>() > 0.98);
  CHECK(made.at("detectable").at("gain").contains("percent"));
  CHECK(made.at("detectable").at("dead_time").contains("seconds"));
  CHECK(made.at("detectable").at("stiction").contains("percent_of_span"));
  CHECK(made.at("simulated_years").get<double>() > 0.0);
  const ShellOutcome checked =
      loopwarden("check " + bench.path("out/twin.yaml") + " " + bench.path("out/specialists"));
  INFO(checked.text);
  CHECK(checked.exit_code == 0);
  const ShellOutcome replayed = loopwarden("replay " + bench.path("record.csv") +
                                           " --specialists " + bench.path("out/specialists") +
                                           " --twin " + bench.path("out/twin.yaml") + " --json");
  INFO(replayed.text);
  REQUIRE(replayed.exit_code == 0);
  CHECK(json::parse(replayed.text).at("transitions").empty());

  // The same loop later, with a fifth less gain, gives a new twin. The old one is unchanged.
  write_file(bench.folder / "truth.yaml",
             model_text(0.8,
                        "duration: 300, seed: 2, set_point: [[0, 3], [20, 5], [60, 6.5], [100, "
                        "4], [140, 5.5], [200, 3.5]]"));
  REQUIRE(loopwarden("simulate " + bench.path("truth.yaml") + " --out " + bench.path("later.csv"))
              .exit_code == 0);
  const std::string old_twin = read_file(bench.folder / "out/twin.yaml");
  const ShellOutcome again = loopwarden(
      "commission " + bench.path("later.csv") + " --accept-short --windows 700 --again " +
      bench.path("out/twin.yaml") + " --out " + bench.path("again"));
  INFO(again.text);
  REQUIRE(again.exit_code == 0);
  CHECK(again.text.find("Since it was commissioned") != std::string::npos);
  CHECK(read_file(bench.folder / "out/twin.yaml") == old_twin);
  const json changes = json::parse(read_file(bench.folder / "again/commission.json")).at("changes");
  REQUIRE(changes.at(0).at("what").get<std::string>().rfind("gain", 0) == 0);
  CHECK(changes.at(0).at("before").get<double>() == Approx(1.0).epsilon(0.02));
  CHECK(changes.at(0).at("now").get<double>() == Approx(0.8).epsilon(0.02));
  CHECK(changes.at(2).at("now").get<double>() ==
        Approx(changes.at(2).at("before").get<double>()).margin(0.15));
}

TEST_CASE("a loop that changes raises model_gap, with its explanation", "[commission][replay]") {
  const std::string moves =
      "set_point: [[0, 4], [20, 5.5], [60, 4], [100, 5.5], [140, 4], [180, 5.5], [220, 4], "
      "[260, 5.5], [300, 4], [340, 5.5], [380, 4], [420, 5.5]]";
  const Bench bench("duration: 460, " + moves +
                        ", faults: [{effect: gain_change, factor: 1.5, block: process, from: 150}]",
                    1.0);
  write_file(bench.folder / "twin.yaml", model_text(1.0, "duration: 460, " + moves));
  const std::string replay = "replay " + bench.path("record.csv") + " --twin " +
                             bench.path("twin.yaml") + " --pv-range 0 10 --co-range 0 10 --json";
  const ShellOutcome out = loopwarden(replay);
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  const json transitions = json::parse(out.text).at("transitions");
  REQUIRE(!transitions.empty());
  CHECK(transitions[0].at("alarm") == "model_gap");
  CHECK(transitions[0].at("reason") == "twin");
  CHECK(transitions[0].at("time_s").get<double>() > 150.0);
  const json& explanation = transitions[0].at("explanation");
  REQUIRE(!explanation.at("effects").empty());
  CHECK(explanation.at("effects")[0].at("name") == "gain_change");
  CHECK(explanation.at("agrees") == true);
  CHECK(explanation.at("from_s").get<double>() == Approx(150.0).margin(40.0));

  const json incidents = json::parse(out.text).at("incidents");
  REQUIRE(incidents.size() == 1);
  CHECK(incidents[0].at("name") == "gain_change");
  CHECK(incidents[0].at("cause") == "process");
  CHECK(incidents[0].at("alarms")[0] == "model_gap");
  CHECK(incidents[0].at("from_s").get<double>() == Approx(explanation.at("from_s").get<double>()));
  CHECK(incidents[0].at("explanation").at("verdict") == "missing_effect");
  CHECK(incidents[0].at("renamed")[0].at("from") == "no_longer_as_commissioned");

  const ShellOutcome plain = loopwarden(replay + " --no-explain");
  CHECK(json::parse(plain.text).at("transitions")[0].at("explanation").is_null());
}

TEST_CASE("an alarm's evidence is explained in its folder", "[commission][explain]") {
  const std::string moves =
      "set_point: [[0, 4], [20, 5.5], [60, 4], [100, 5.5], [140, 4], [180, 5.5], [220, 4], "
      "[260, 5.5], [300, 4], [340, 5.5], [380, 4], [420, 5.5]]";
  const Bench bench("duration: 460, " + moves +
                        ", faults: [{effect: gain_change, factor: 1.5, block: process, from: 150}]",
                    1.0);
  fs::create_directory(bench.folder / "e");
  const ShellOutcome none = loopwarden("explain " + bench.path("e"));
  CHECK(none.exit_code == 65);
  CHECK(none.text.find("no twin.yaml") != std::string::npos);
  write_file(bench.folder / "e/twin.yaml", model_text(1.0, "duration: 460, " + moves));
  const ShellOutcome lone = loopwarden("explain " + bench.path("e"));
  CHECK(lone.exit_code == 65);
  CHECK(lone.text.find("evidence.json: not there") != std::string::npos);
  write_file(bench.folder / "e/evidence.json",
             R"({"alarm": "stiction", "raised_ms": 1800000000000, "loop": "FIC-101"})");
  // Evidence as the daemon writes it, with time relative to the alarm at 200 s.
  std::string csv = read_file(bench.folder / "record.csv");
  std::string minutes;
  std::size_t begin = 0;
  while (begin < csv.size()) {
    const std::size_t end = csv.find('\n', begin);
    const std::string line = csv.substr(begin, end - begin);
    const std::size_t comma = line.find(',');
    minutes += begin == 0 ? line : std::to_string(std::stod(line) - 200.0) + line.substr(comma);
    minutes += "\n";
    begin = end + 1;
  }
  write_file(bench.folder / "e/minutes.csv", minutes);
  const ShellOutcome out = loopwarden("explain --json " + bench.path("e"));
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  const json said = json::parse(read_file(bench.folder / "e/explanation.json"));
  CHECK(said == json::parse(out.text));
  CHECK(said.at("alarm") == "stiction");
  CHECK(said.at("raised_ms") == 1800000000000);
  REQUIRE(!said.at("first").is_null());
  CHECK(said.at("first").at("name") == "gain_change");
  CHECK(said.at("first").at("number").get<int>() > 0);
  CHECK(!said.at("first").at("remedy").get<std::string>().empty());
  CHECK(said.at("from_s").get<double>() == Approx(-50.0).margin(40.0));
  // The cause is outside the valve. If the explanation is sure, it names model_gap. Otherwise the
  // alarm stays stiction and the explanation does not agree.
  const bool sure = said.at("first").at("confidence").get<double>() >= 0.9;
  CHECK(said.at("final_name") == (sure ? json("model_gap") : json()));
  CHECK(said.at("agrees") == sure);
  CHECK(fs::exists(bench.folder / "e/report.html"));
  CHECK(said.at("next_test").is_null() != fs::exists(bench.folder / "e/next_test.yaml"));

  // A later explanation keeps a test that the operator of a watched loop has made.
  json made = said;
  made["next_test"] = {{"text", "Move SP."}, {"planned_at", 7}, {"valid_until_ms", 8}};
  write_file(bench.folder / "e/explanation.json", made.dump());
  write_file(bench.folder / "e/test/test.json", R"({"planned_at": 7, "done": true})");
  REQUIRE(loopwarden("explain " + bench.path("e")).exit_code == 0);
  const json later = json::parse(read_file(bench.folder / "e/explanation.json"));
  CHECK(later.at("next_test") == made.at("next_test"));
}

TEST_CASE("a record that can't be commissioned gives the reason and its exit code",
          "[commission]") {
  const TemporaryFolder folder;
  write_file(folder / "bad.csv", "time,pv\n0,1\n0.1,x\n");
  CHECK(loopwarden("commission " + (folder / "bad.csv").string() + " --out " +
                   (folder / "out").string())
            .exit_code == 65);
  CHECK(loopwarden("commission " + (folder / "none.csv").string() + " --out " +
                   (folder / "out").string())
            .exit_code == 74);
  CHECK(loopwarden("commission").exit_code == 64);
  CHECK(!fs::exists(folder / "out"));
}

TEST_CASE("a model with other ranges than the loop is refused", "[commission]") {
  const Bench bench("duration: 60, set_point: [[0, 3]]");
  const auto commission = [&](const std::string& options) {
    return loopwarden("commission " + bench.path("record.csv") + " --out " + bench.path("out") +
                      " --model " + bench.path("rough.yaml") + " " + options);
  };
  const ShellOutcome pv = commission("--pv-range 0 25");
  CHECK(pv.exit_code == 78);
  CHECK_THAT(pv.text, Catch::Contains("transmitter.range is [0, 10], and the loop has [0, 25]"));
  CHECK(commission("--co-range 0 100").exit_code == 78);
  CHECK(commission("--pv-range 25 0").exit_code == 64);
  CHECK(commission("--pv-range 0 10 --co-range 0 10").exit_code == 0);
}

TEST_CASE("the twin has the given ranges", "[commission][long]") {
  const Bench bench(
      "duration: 300, set_point: [[0, 3], [20, 5], [60, 6.5], [100, 4], [140, 5.5], [200, 3.5]]");
  const json made =
      bench.commissioned("--accept-short --windows 700 --pv-range -5 25 --co-range 0 12");
  REQUIRE(made.at("verdict") == "commissioned");
  const std::string twin = read_file(bench.folder / "out" / "twin.yaml");
  INFO(twin);
  CHECK(twin.find("range: [-5, 25]") != std::string::npos);
  CHECK(twin.find("output: [0, 12]") != std::string::npos);
}

}  // namespace loopwarden::tests::commission_test
