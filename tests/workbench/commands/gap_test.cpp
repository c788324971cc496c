// SPDX-License-Identifier: Apache-2.0
// `loopwarden gap` as its users call it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "record/record_csv.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::gap_test {
namespace {

namespace fs = std::filesystem;

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

// Returns a model with the process gain `gain`.
std::string model_text(double gain) {
  return "sample_time: 0.1\n"
         "controller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
         "process: {gain: " +
         std::to_string(gain) +
         ", time_constant: 1.5, dead_time: 0.6}\n"
         "transmitter: {range: [0, 10], resolution: 0.0025, noise: 0.01}\n"
         "scenario: {duration: 70, set_point: [[0, 3], [5, 5], [20, 6.5], [35, 4], [50, 5.5]]}\n";
}

// Model and record of a loop with less gain than in the model.
class Case {
 public:
  Case() {
    write_file(folder_ / "truth.yaml", model_text(0.8));
    write_file(folder_ / "model.yaml", model_text(1.1));
    const ShellOutcome simulated =
        loopwarden("simulate " + path("truth.yaml") + " --out " + path("record.csv"));
    INFO(simulated.text);
    REQUIRE(simulated.exit_code == 0);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  ShellOutcome gap(const std::string& record, const std::string& model,
                   const std::string& out) const {
    return loopwarden("gap " + path(record) + " --model " + path(model) + " --out " + out);
  }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
};

TEST_CASE("gap writes its result, and a corrected model that simulates", "[gap][program]") {
  const Case one;
  const std::string out = one.path("new/result");
  const ShellOutcome outcome = one.gap("record.csv", "model.yaml", out);
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.text.find("gain_change") != std::string::npos);
  CHECK(outcome.text.find("none of these") != std::string::npos);
  CHECK(std::count(outcome.text.begin(), outcome.text.end(), '\n') <= 15);
  const std::string report = read_file(fs::path(out) / "report.html");
  CHECK(report.find("gain_change") != std::string::npos);
  CHECK(report.find("PV over stem") != std::string::npos);  // the record has a stem

  const auto result = nlohmann::json::parse(read_file(fs::path(out) / "gap.json"));
  for (const char* key :
       {"verdict", "sentence", "compared", "effects", "posterior", "gap", "remainder", "located",
        "candidates", "holdout_from_s", "record", "corrected_model"}) {
    CAPTURE(key);
    CHECK(result.contains(key));
  }
  CHECK(result.at("verdict") == "missing_effect");
  CHECK(result.at("effects").at(0).at("name") == "gain_change");
  CHECK(result.at("effects").at(0).at("parameters").at("factor").get<double>() ==
        Approx(0.8 / 1.1).epsilon(0.02));
  CHECK(result.at("gap").at("after").at("holdout_rmse").get<double>() <
        0.2 * result.at("gap").at("before").at("holdout_rmse").get<double>());
  CHECK(result.at("compared") == "measured_output");

  const std::string corrected = out + "/model.corrected.yaml";
  CHECK(loopwarden("check " + corrected).exit_code == 0);
  CHECK(loopwarden("simulate " + corrected + " --out " + one.path("again.csv")).exit_code == 0);
  CHECK(record::read_record(one.path("again.csv")).size() == 701);
  // Its pictures can be extracted for documents.
  const std::string tool = "python3 " LOOPWARDEN_SOURCE_DIR "/tools/report_picture.py ";
  const ShellOutcome picture =
      run(tool + out + "/report.html residual > " + one.path("picture.svg") +
          " && python3 -c \"import xml.dom." + "minidom as m; m.parse('" + one.path("picture.svg") +
          "')\" 2>&1");
  INFO(picture.text);
  CHECK(picture.exit_code == 0);
  CHECK(run(tool + out + "/report.html nothing 2>&1").exit_code == 65);
  // No temporary file is left.
  for (const auto& entry : fs::directory_iterator(out)) CHECK(entry.path().extension() != ".tmp");
}

TEST_CASE("gap without a model identifies one, and reports its assumptions", "[gap][program]") {
  const Case one;
  const std::string out = one.path("result");
  const ShellOutcome outcome =
      loopwarden("gap " + one.path("record.csv") + " --verbose --out " + out);
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.text.find("assumed: ") != std::string::npos);
  const std::string assumed = read_file(fs::path(out) / "model.assumed.yaml");
  CHECK(assumed.find("# assumed by loopwarden gap from ") != std::string::npos);
  CHECK(loopwarden("check " + out + "/model.assumed.yaml").exit_code == 0);
  // The model was identified from this record, so no effect is missing.
  const auto result = nlohmann::json::parse(read_file(fs::path(out) / "gap.json"));
  CHECK(result.at("verdict") == "no_gap");
}

TEST_CASE(
    "gap and identify refuse the same record, which is in automatic by its column with SP at rest",
    "[gap][program]") {
  const TemporaryFolder folder;
  std::string record = "time,sp,pv,co,mode\n";
  std::uint32_t noise = 1;
  double pv = 5.0;
  for (int k = 0; k < 1200; ++k) {
    noise = noise * 1664525U + 1013904223U;
    pv += 0.05 * (5.0 - pv) + 0.1 * (static_cast<double>(noise >> 8U) / 16777216.0 - 0.5);
    record += std::to_string(0.1 * k) + ",5," + std::to_string(pv) + "," +
              std::to_string(4.0 + (k / 300 % 2 == 0 ? 0.0 : 0.5)) + ",AUTO\n";
  }
  write_file(folder / "r.csv", record);
  const ShellOutcome identified = loopwarden("identify " + (folder / "r.csv").string());
  const ShellOutcome searched =
      loopwarden("gap " + (folder / "r.csv").string() + " --out " + (folder / "out").string());
  INFO(identified.text << searched.text);
  CHECK(identified.exit_code == 65);
  CHECK(searched.exit_code == 65);
  for (const ShellOutcome* outcome : {&identified, &searched}) {
    CHECK(outcome->text.find("SP never moves") != std::string::npos);
  }
  CHECK_FALSE(fs::exists(folder / "out" / "gap.json"));
}

TEST_CASE("gap refuses uninformative records with 65", "[gap][program]") {
  const Case one;
  const std::string out = one.path("result");
  const std::string record = read_file(one.folder() / "record.csv");
  std::size_t end = 0;
  for (int line = 0; line < 120; ++line) end = record.find('\n', end) + 1;
  write_file(one.folder() / "short.csv", record.substr(0, end));
  const ShellOutcome brief = one.gap("short.csv", "model.yaml", out);
  CHECK(brief.exit_code == 65);
  CHECK(brief.text.find("short.csv: only 119 samples") != std::string::npos);
  write_file(one.folder() / "bad.csv", "time,pv\n0,1\n0.1,high\n");
  const ShellOutcome bad = one.gap("bad.csv", "model.yaml", out);
  CHECK(bad.exit_code == 65);
  CHECK(bad.text.find("bad.csv:3") != std::string::npos);
  CHECK_FALSE(fs::exists(fs::path(out) / "gap.json"));
}

TEST_CASE("gap ends with 78 for a bad model, 74 for an impossible file or folder, 64 for misuse",
          "[gap][program]") {
  const Case one;
  const std::string out = one.path("result");
  write_file(one.folder() / "bad.yaml", "sample_time: 0\n");
  const ShellOutcome bad = one.gap("record.csv", "bad.yaml", out);
  CHECK(bad.exit_code == 78);
  CHECK(bad.text.find("bad.yaml:1:") != std::string::npos);
  CHECK(one.gap("absent.csv", "model.yaml", out).exit_code == 74);
  // A file exists at the path of the folder. This is reported before any work.
  CHECK(one.gap("absent.csv", "model.yaml", one.path("record.csv")).text.find("record.csv: ") !=
        std::string::npos);
  CHECK(one.gap("record.csv", "model.yaml", one.path("model.yaml") + " --without several")
            .exit_code == 74);
  CHECK(loopwarden("gap " + one.path("record.csv")).exit_code == 64);
  CHECK(loopwarden("gap " + one.path("record.csv") + " --model " + one.path("model.yaml") +
                   " --out " + out + " --without everything")
            .exit_code == 64);
}

// Runs gap on a measured case with its model and returns gap.json.
nlohmann::json measured(const std::string& name) {
  const fs::path data = fs::path(LOOPWARDEN_SOURCE_DIR) / "examples/measured/gap" / name;
  const TemporaryFolder folder;
  const ShellOutcome outcome =
      loopwarden("gap " + (data / "record.csv").string() + " --model " +
                 (data / "model.yaml").string() + " --out " + (folder / "found").string());
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  return nlohmann::json::parse(read_file(folder / "found/gap.json"));
}

double closed(const nlohmann::json& gap) {
  const double before = gap["before"]["holdout_rmse"];
  const double after = gap["after"]["holdout_rmse"];
  const double floor = gap["noise_floor_rmse"];
  return (before * before - after * after) / (before * before - floor * floor);
}

TEST_CASE("a measured sticking valve is named from a rough model, without a place in its travel",
          "[gap][program][long]") {
  const nlohmann::json answer = measured("rse_fcv701");
  CHECK(answer["verdict"] == "missing_effect");
  REQUIRE(answer["effects"].size() == 1);
  const nlohmann::json& effect = answer["effects"][0];
  CHECK(effect["name"] == "stiction");
  CHECK(effect["parameters"]["s"] > 5.0);  // CO turns after 6 %
  CHECK(effect["parameters"]["s"] < 8.0);
  // CO never left the range in which the valve sticks.
  for (const nlohmann::json& other : effect["alternatives"]) CHECK(other == "cam_obstruction");
  // The model's gain can account for PV, so the fit stays at the model's level.
  CHECK(closed(answer["gap"]) > 0.95);
}

// Writes the same record with PV changed by less than its written digits, as rounding on another
// processor does.
void write_rounded_otherwise(const fs::path& from, const fs::path& to, double by) {
  record::Record record = record::read_record(from);
  for (std::size_t k = 0; k < record.size(); ++k) record.pv[k] *= 1.0 + (k % 3 == 0 ? by : -by);
  record::write_record(record, to);
}

TEST_CASE("a measured limit cycle is named without a model, with any rounding of the numbers",
          "[gap][program][long]") {
  const fs::path record =
      fs::path(LOOPWARDEN_SOURCE_DIR) / "examples/measured/gap/rse_fcv701/record.csv";
  const TemporaryFolder folder;
  const double by = GENERATE(0.0, 1e-12);
  write_rounded_otherwise(record, folder / "record.csv", by);
  const ShellOutcome outcome = loopwarden("gap " + (folder / "record.csv").string() + " --out " +
                                          (folder / "found").string());
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  const nlohmann::json answer = nlohmann::json::parse(read_file(folder / "found/gap.json"));
  CHECK(answer["verdict"] == "missing_effect");
  REQUIRE(answer["effects"].size() == 1);
  const nlohmann::json& stiction = answer["effects"][0];
  CHECK(stiction["name"] == "stiction");
  CHECK(stiction["confidence"] < 0.9);
  CHECK(stiction["parameters"]["s"] > 4.5);
  CHECK(stiction["parameters"]["s"] < 7.5);
  // Fits that differ by a tenth of a band or more are equally likely, and the interval covers them.
  CHECK(stiction["interval"]["s"][0] > 3.0);
  CHECK(stiction["interval"]["s"][1] < 8.5);
  CHECK(closed(answer["gap"]) > 0.6);
  // The level is taken from the record, and belongs to the gain of the identified model.
  CHECK(answer["gap"]["before"]["holdout_rmse"] < 0.3);
  CHECK(answer["gap"]["after"]["holdout_rmse"] < 0.12);
}

TEST_CASE(
    "the interval of a stick band reaches to equally likely fits, and contains the true value",
    "[gap][program][long]") {
  const fs::path data = fs::path(LOOPWARDEN_SOURCE_DIR) / "examples/gap-example";
  const TemporaryFolder folder;
  const ShellOutcome outcome =
      loopwarden("gap " + (data / "record.csv").string() + " --model " +
                 (data / "model.yaml").string() + " --out " + (folder / "found").string());
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  const nlohmann::json answer = nlohmann::json::parse(read_file(folder / "found/gap.json"));
  REQUIRE(answer["effects"].size() == 1);
  const nlohmann::json& stiction = answer["effects"][0];
  CHECK(stiction["name"] == "stiction");
  // An interval from the curvature only is a thousandth wide and misses 0.914.
  const nlohmann::json& s = stiction["interval"]["s"];
  CHECK(s[0] < 0.914);
  CHECK(s[1] > 0.914);
  CHECK(s[1].get<double>() - s[0].get<double>() > 0.01);
}

TEST_CASE("a heater without the room temperature in its model has no valve fault",
          "[gap][program]") {
  const TemporaryFolder folder;
  const auto model = [](const std::string& level) {
    return "sample_time: 1\n"
           "controller: {kp: 2, ki: 0.05, output: [0, 100]}\n"
           "valve: none\n"
           "process: {gain: 0.5, " +
           level +
           "time_constant: 40, dead_time: 3}\n"
           "transmitter: {range: [0, 100], resolution: 0.01, noise: 0.05}\n"
           "scenario: {duration: 600, set_point: [[0, 40], [60, 50], [240, 44], [420, 52]]}\n";
  };
  write_file(folder / "truth.yaml", model("level: 22, "));
  write_file(folder / "model.yaml", model(""));
  const auto path = [&](const char* name) { return (folder / name).string(); };
  REQUIRE(loopwarden("simulate " + path("truth.yaml") + " --out " + path("record.csv")).exit_code ==
          0);
  const auto answer = [&](const char* name) {
    const ShellOutcome outcome = loopwarden("gap " + path("record.csv") + " --model " + path(name) +
                                            " --jobs 1 --out " + path("found"));
    INFO(outcome.text);
    REQUIRE(outcome.exit_code == 0);
    return nlohmann::json::parse(read_file(folder / "found/gap.json"));
  };
  const nlohmann::json unknown = answer("model.yaml");
  REQUIRE(unknown["effects"].size() == 1);
  CHECK(unknown["effects"][0]["name"] == "output_bias");
  CHECK(unknown["effects"][0]["parameters"]["bias"] == Approx(22.0).margin(0.5));
  for (const nlohmann::json& tried : unknown["candidates"]) CHECK(tried["name"] != "stiction");
  CHECK(answer("truth.yaml")["verdict"] == "no_gap");
}

TEST_CASE("a sticking valve is named in addition to a level that the model omits",
          "[gap][program]") {
  const TemporaryFolder folder;
  const auto model = [](const std::string& level, const std::string& effects) {
    return "sample_time: 1\n"
           "controller: {kp: 0.8, ki: 0.04, output: [0, 100]}\n"
           "valve: {effects: [" +
           effects + "]}\nprocess: {gain: 1.2, " + level +
           "time_constant: 12, dead_time: 3}\n"
           "transmitter: {range: [0, 200], resolution: 0.01, noise: 0.05}\n"
           "scenario: {duration: 1500, set_point: [[0, 72], [300, 80], [600, 66], [900, 85], "
           "[1200, 75]]}\n";
  };
  write_file(folder / "truth.yaml", model("level: 30, ", "{effect: stiction, s: 6, j: 3}"));
  write_file(folder / "model.yaml", model("", ""));
  const auto path = [&](const char* name) { return (folder / name).string(); };
  REQUIRE(loopwarden("simulate " + path("truth.yaml") + " --out " + path("record.csv")).exit_code ==
          0);
  const ShellOutcome outcome = loopwarden("gap " + path("record.csv") + " --model " +
                                          path("model.yaml") + " --out " + path("found"));
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  const nlohmann::json found = nlohmann::json::parse(read_file(folder / "found/gap.json"));
  REQUIRE(found["effects"].size() == 2);
  CHECK(found["effects"][0]["name"] == "stiction");
  CHECK(found["effects"][0]["parameters"]["s"] == Approx(6.0).epsilon(0.15));
  CHECK(found["effects"][1]["name"] == "output_bias");
  CHECK(found["effects"][1]["parameters"]["bias"] == Approx(30.0).margin(3.0));
}

TEST_CASE("the level of PV is taken from the record if the process was identified from it",
          "[gap][program][long]") {
  // A temperature around 318. Only changes of PV identify its process.
  const fs::path record = fs::path(LOOPWARDEN_SOURCE_DIR) / "examples/measured/rse_1704_tcv701.csv";
  const TemporaryFolder folder;
  const ShellOutcome outcome =
      loopwarden("gap " + record.string() + " --out " + (folder / "found").string());
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  const nlohmann::json answer = nlohmann::json::parse(read_file(folder / "found/gap.json"));
  CHECK(answer["gap"]["before"]["rmse"] < 2.0);
  for (const nlohmann::json& effect : answer["effects"]) CHECK(effect["name"] != "output_bias");
}

TEST_CASE("a measured valve that sticks during a disturbance is named first",
          "[gap][program][long]") {
  const nlohmann::json answer = measured("rse_fcv731");
  CHECK(answer["verdict"] == "missing_effect");
  REQUIRE_FALSE(answer["effects"].empty());
  CHECK(answer["effects"][0]["name"] == "stiction");
  CHECK(answer["effects"][0]["parameters"]["s"] == Approx(6.0).epsilon(0.25));
  CHECK(closed(answer["gap"]) > 0.9);
}

TEST_CASE("a stem is compared with its command, which tests only the valve", "[gap][program]") {
  TemporaryFolder folder;
  std::string record = "time,pv,co,stem\n";
  double stem = 50.0;
  bool moves = false;
  for (int k = 0; k < 900; ++k) {
    const double co = 50.0 + 12.0 * std::sin(0.021 * k) + (k / 110 % 2 == 0 ? 6.0 : -6.0);
    record += std::to_string(k) + ",1," + std::to_string(co) + "," +
              std::to_string(stem + 0.02 * std::sin(7.7 * k)) + "\n";
    // A drive of 2 %/s with a band of 1.5 %.
    const double away = co - stem;
    moves = moves || std::abs(away) > 1.5;
    if (moves && std::abs(away) > 2.0) {
      stem += std::copysign(2.0, away);
    } else if (moves) {
      stem = co;
      moves = false;
    }
  }
  write_file(folder / "drive.csv", record);
  const std::string out = (folder / "found").string();
  const ShellOutcome outcome =
      loopwarden("gap " + (folder / "drive.csv").string() + " --stem --out " + out);
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.text.find("The stem replaces PV") != std::string::npos);
  const auto answer = nlohmann::json::parse(read_file(folder / "found/gap.json"));
  REQUIRE(answer["effects"].size() == 1);
  const nlohmann::json& effect = answer["effects"][0];
  CHECK(effect["name"] == "deadband_drive");
  CHECK(effect["parameters"]["band"] == Approx(1.5).epsilon(0.1));
  CHECK(effect["parameters"]["rate"] == Approx(2.0).epsilon(0.1));
  CHECK(effect["alternatives"].size() >= 2);
  write_file(folder / "no_stem.csv", "time,pv,co\n0,1,2\n1,1,2\n2,1,2\n");
  const ShellOutcome none =
      loopwarden("gap " + (folder / "no_stem.csv").string() + " --stem --out " + out);
  CHECK(none.exit_code == 65);
  CHECK(none.text.find("has no column stem") != std::string::npos);
}

}  // namespace
}  // namespace loopwarden::tests::gap_test
