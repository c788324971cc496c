// SPDX-License-Identifier: Apache-2.0
// From an export with a site's own names to the fitter's finding and the next survey.
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "record/record_csv.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/survey/survey_support.hpp"

namespace loopwarden::tests::outcome_command_test {
namespace {

namespace fs = std::filesystem;
using Catch::Contains;
using nlohmann::json;

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

json read_json(const fs::path& path) { return json::parse(read_file(path)); }

constexpr const char* kRules =
    "rules:\n"
    "  - {match: \"FT*\", signal: pv, loop: \"FIC$1\", unit: m3/h, range: [0, 40]}\n"
    "  - {match: \"FV*\", signal: co, loop: \"FIC$1\", range: [4, 20], unit: mA}\n"
    "  - {match: \"FIC*.W\", signal: sp, loop: \"FIC$1\"}\n"
    "  - {match: \"FIC*.BA\", signal: mode, loop: \"FIC$1\", automatic: [REG], manual: [HND]}\n"
    "  - {match: \"TT*\", signal: pv, loop: \"TIC$1\"}\n";

// Two loops whose names don't show the signal. The valve of the second one sticks by 5 % of CO.
class Site {
 public:
  Site() {
    write_file(folder_ / "rules.yaml", kRules);
    const record::Record calm = simulated("", 1);
    const record::Record sticky =
        simulated("valve:\n  effects:\n    - {effect: stiction, s: 5, j: 2}\n", 2);
    std::string text = "Timestamp,FT1,FV1,FIC1.W,FIC1.BA,FT2,FV2,FIC2.W,FIC2.BA,Comment\n";
    for (std::size_t k = 0; k < calm.size(); ++k) {
      char row[200];
      const auto ma = [](double co) { return 4.0 + 0.16 * co; };
      std::snprintf(row, sizeof row,
                    "2026-03-01T%02zu:%02zu:%02zuZ,%.4f,%.5f,%g,%s,%.4f,%.5f,%g,REG,-\n",
                    10 + k / 3600, k / 60 % 60, k % 60, calm.pv[k], ma(calm.co[k]), calm.sp[k],
                    k < 100 ? "HND" : "REG", sticky.pv[k], ma(sticky.co[k]), sticky.sp[k]);
      text += row;
    }
    write_file(folder_ / "e.csv", text);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  const TemporaryFolder& folder() const { return folder_; }
  std::string survey() const {
    return "survey " + path("e.csv") + " --rules " + path("rules.yaml") + " --out " + path("s");
  }

 private:
  record::Record simulated(const std::string& valve, int seed) {
    write_file(
        folder_ / "m.yaml",
        "sample_time: 1.0\ncontroller: {kp: 1.0, ki: 0.12, output: [0, 100]}\n" + valve +
            "process: {gain: 0.36, time_constant: 4.0, dead_time: 2.0}\n"
            "transmitter: {range: [0, 40], resolution: 0.001, noise: 0.04}\n"
            "disturbances:\n  - {effect: random_load, intensity: 0.02, time_constant: 200}\n"
            "scenario: {duration: 3600, set_point: [[0, 18], [600, 20], [1300, 17], [2000, 19], "
            "[2800, 21]], seed: " +
            std::to_string(seed) + "}\n");
    const ShellOutcome made = loopwarden("simulate " + path("m.yaml") + " --out " + path("r.csv"));
    INFO(made.text);
    REQUIRE(made.exit_code == 0);
    return record::read_record(folder_ / "r.csv");
  }

  TemporaryFolder folder_;
};

TEST_CASE("a site's rules make loops of names without signal endings", "[rules][import][program]") {
  const Site site;
  const ShellOutcome without =
      loopwarden("survey " + site.path("e.csv") + " --out " + site.path("n"));
  CHECK(without.exit_code == 65);
  CHECK_THAT(without.text, Contains("9 columns or tags belong to no loop") &&
                               Contains("--rules RULES.yaml assigns them to loops"));
  const ShellOutcome made = loopwarden(site.survey());
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  CHECK_THAT(made.text, Contains("1 column or tag belongs to no loop: 'Comment'") &&
                            Contains("rules.yaml:6: 'TT*' matches no column or tag"));
  const json survey = read_json(site.folder() / "s/survey.json");
  REQUIRE(survey["loops"].size() == 2);
  const json& first = survey["loops"][0]["tag"] == "FIC1" ? survey["loops"][0] : survey["loops"][1];
  CHECK(first["co_range"] == json{4.0, 20.0});
  CHECK(first["share_automatic"].get<double>() == Approx(0.972).margin(0.002));
  CHECK(first["import"]["units"]["co"] == "mA");
  CHECK(first["import"]["ranges"]["pv"] == json{0.0, 40.0});
  // Changed rules for a loop renew only its own result.
  CHECK_THAT(loopwarden(site.survey()).text, Contains("2 from an earlier run"));
  std::string rules = kRules;
  write_file(site.folder() / "rules.yaml",
             rules.insert(7, "  - {match: \"FT1\", signal: pv, loop: FIC1, range: [0, 50]}\n"));
  CHECK_THAT(loopwarden(site.survey()).text, Contains("1 judged, 1 from an earlier run"));
  // Conflicting rules, and an invalid rule.
  write_file(site.folder() / "rules.yaml",
             "rules:\n  - {match: \"F[TV]*\", signal: pv, loop: \"FIC$2\"}\n");
  const ShellOutcome clash = loopwarden(site.survey());
  CHECK(clash.exit_code == 65);
  CHECK_THAT(clash.text, Contains("FIC1: two names are its pv: 'FT1' by ") &&
                             Contains("rules.yaml:2 and 'FV1' by "));
  write_file(site.folder() / "rules.yaml", "rule: []\n");
  CHECK(loopwarden(site.survey()).exit_code == 78);
  CHECK(loopwarden(site.survey() + " --map pv=FT1,co=FV1").exit_code == 64);
}

TEST_CASE("the fitter's finding is kept, shown by the next survey, and exported without names",
          "[outcome][program]") {
  const Site site;
  REQUIRE(loopwarden(site.survey()).exit_code == 0);
  const std::string at = " --survey " + site.path("s");
  // A band with a small jump: this test does not depend on its name.
  std::string name;
  const json judged = read_json(site.folder() / "s/survey.json");
  for (const json& loop : judged["loops"]) {
    if (loop["tag"] == "FIC2") name = loop["effects"].at(0)["name"];
  }
  CAPTURE(name);
  REQUIRE((name == "stiction" || name == "backlash"));
  CHECK_THAT(loopwarden("outcome --list" + at).text, Contains("no answers yet"));
  const ShellOutcome answered =
      loopwarden("outcome fic2 --found stiction --note \"packing, tight\"" + at);
  INFO(answered.text);
  REQUIRE(answered.exit_code == 0);
  CHECK_THAT(answered.text, Contains("FIC2: stiction found; the survey's finding: " + name));
  REQUIRE(loopwarden("outcome FIC1 --found nothing" + at).exit_code == 0);
  const ShellOutcome wrong = loopwarden("outcome FIC22 --found air" + at);
  CHECK(wrong.exit_code == 65);
  CHECK_THAT(wrong.text, Contains("no loop 'FIC22'; did you mean 'FIC"));
  CHECK(loopwarden("outcome FIC2 --found rust" + at).exit_code == 64);
  CHECK(loopwarden("outcome FIC2" + at).exit_code == 64);
  CHECK(loopwarden("outcome FIC2 --found air --survey /nonexistent").exit_code == 74);

  const ShellOutcome again = loopwarden(site.survey());
  INFO(again.text);
  CHECK(again.exit_code == 0);
  CHECK_THAT(again.text, Contains("2 from an earlier run") && Contains("2 answered by outcome"));
  const json survey = read_json(site.folder() / "s/survey.json");
  CHECK(survey["outcomes"]["answered"] == 2);
  CHECK(survey["loops"][0]["outcome"]["note"] == "packing, tight");
  CHECK_THAT(read_file(site.folder() / "s/survey.html"), Contains("found: stiction, 20"));
  const json listed = json::parse(loopwarden("outcome --list --json" + at).text);
  CHECK(listed["outcomes"][0]["tag"] == "FIC2");

  // A rejected finding is suppressed.
  REQUIRE(loopwarden("outcome FIC2 --found nothing" + at).exit_code == 0);
  REQUIRE(loopwarden(site.survey() + " --outcomes " + site.path("s/outcomes.csv")).exit_code == 0);
  const json rejected = read_json(site.folder() / "s/survey.json");
  for (const json& loop : rejected["loops"]) CHECK(loop["held_back"] == (loop["tag"] == "FIC2"));
  CHECK(loopwarden(site.survey() + " --outcomes " + site.path("none.csv")).exit_code == 74);

  const std::string from = " --from " + site.path("e.csv") + " --rules " + site.path("rules.yaml");
  const ShellOutcome exported = loopwarden("outcome --export " + site.path("a") + from + at);
  INFO(exported.text);
  REQUIRE(exported.exit_code == 0);
  const std::string labels = read_file(site.folder() / "a/labels.csv");
  CHECK_THAT(labels, Contains("record-0002.csv,nothing,flow,valve_effect," + name + ","));
  const record::Record r = record::read_record(site.folder() / "a/record-0002.csv");
  CHECK(r.time_s.front() == 0.0);
  CHECK(r.size() == 3601);
  CHECK(!r.automatic.empty());
  CHECK(r.pv.front() == Approx(45.0).margin(1.0));  // 18 of 0 to 40
  CHECK(r.co.front() == Approx(50.0).margin(1.0));  // 12 of 4 to 20
  for (const auto& entry : fs::directory_iterator(site.folder() / "a")) {
    const std::string text = read_file(entry.path());
    CHECK(text.find("FIC") == std::string::npos);
    CHECK(text.find("2026-0") == std::string::npos);
    CHECK(text.find("m3/h") == std::string::npos);
  }
  // The whole record is longer than the judged part, and the extra part has no label.
  CHECK(loopwarden("outcome --export " + site.path("b") + at).exit_code == 64);
}

TEST_CASE("two surveys side by side, on the terminal and as one page",
          "[survey][changes][program]") {
  const TemporaryFolder folder;
  const auto path = [&](const std::string& name) { return (folder / name).string(); };
  write_file(folder / "now/survey.json",
             survey_of({valve_loop("21-FIC-1", 4.0), survey_loop("21-FIC-2", "healthy")}).dump());
  write_file(folder / "before.json",
             survey_of({survey_loop("21-FIC-1", "healthy"), valve_loop("21-FIC-2", 4.0)}).dump());
  write_file(folder / "loops.csv", "tag,criticality,cost_per_hour\n21-FIC-1,A,40\n");
  const std::string command = "survey --out " + path("now") + " --against " + path("before.json");
  const ShellOutcome told = loopwarden(command + " --loops " + path("loops.csv"));
  INFO(told.text);
  REQUIRE(told.exit_code == 0);
  CHECK_THAT(told.text, Contains("new 1, worse 0, better 0, gone 1") && Contains("A 40/h") &&
                            Contains("changes.html"));
  CHECK(read_json(folder / "now/changes.json")["loops"][0]["cost_per_hour"] == 40.0);
  CHECK_THAT(read_file(folder / "now/changes.html"), Contains("What changed"));
  const ShellOutcome by_pattern = loopwarden(command + " --area \"*-FIC-[0-9]\"");
  CHECK(by_pattern.exit_code == 0);
  CHECK(read_json(folder / "now/changes.json")["areas"][0]["area"] == "21");
  CHECK(loopwarden(command + " --area 21").exit_code == 64);
  CHECK(loopwarden(command + " --area \"[2\"").exit_code == 64);
  CHECK(loopwarden("survey --out " + path("now") + " --area \"*-*\"").exit_code == 64);
  CHECK(loopwarden("survey --out " + path("now")).exit_code == 64);
  write_file(folder / "before.json", "{\"loops\": [{}]}");
  CHECK(loopwarden(command).exit_code == 65);
  CHECK(loopwarden("survey --out " + path("now") + " --against " + path("none")).exit_code == 74);
}

}  // namespace
}  // namespace loopwarden::tests::outcome_command_test
