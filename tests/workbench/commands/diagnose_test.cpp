// SPDX-License-Identifier: Apache-2.0
// diagnose as its users call it, on the open records.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <string>

#include "model/effects/backlash/backlash.hpp"
#include "model/numeric/random.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/report/diagnosis_page.hpp"

namespace loopwarden::tests::diagnose_test {
namespace {

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

const std::string kRoutine = LOOPWARDEN_SOURCE_DIR "/examples/routine/";

nlohmann::json verdict_of(const std::string& file, const std::string& options = "") {
  const ShellOutcome outcome = loopwarden("diagnose " + kRoutine + file + " --json " + options);
  INFO(file << ": " << outcome.text);
  REQUIRE(outcome.exit_code == 0);
  return nlohmann::json::parse(outcome.text);
}

TEST_CASE("a clearly sticking valve of the open records is named with its size") {
  const nlohmann::json wide = verdict_of("r22.csv");
  CHECK(wide.at("verdict") == "valve_effect");
  CHECK(wide.at("effects").at(0).at("name") == "stiction");
  CHECK(wide.at("effects").at(0).at("block") == "valve");
  CHECK(wide.at("cause").is_null());
  CHECK(wide.at("co_range") == nlohmann::json({0.0, 100.0}));
  const double percent = wide.at("effects").at(0).at("percent_of_span").get<double>();
  CHECK(percent > 0.0);
  const nlohmann::json interval = wide.at("effects").at(0).at("interval").at("s");
  CHECK(interval.at(0).get<double>() < percent);
  CHECK(interval.at(1).get<double>() > percent);
  CHECK(percent == Approx(wide.at("effects").at(0).at("parameters").at("s").get<double>()));
  const nlohmann::json narrow = verdict_of("r22.csv", "--co-range 0 50");
  CHECK(narrow.at("effects").at(0).at("percent_of_span").get<double>() == Approx(2.0 * percent));
}

TEST_CASE("a smooth cycle in the open records is no valve effect") {
  for (const char* file : {"r05.csv", "r08.csv", "r12.csv"}) {
    const nlohmann::json cycling = verdict_of(file);
    CHECK(cycling.at("verdict") == "other_cause");
    CHECK(cycling.at("effects").empty());
    CHECK(cycling.at("oscillating") == true);
    CHECK(cycling.at("period_s").get<double>() == Approx(152.0).epsilon(0.05));
    CHECK(std::set<std::string>{"tuning", "disturbance"}.contains(cycling.at("cause")));
  }
}

TEST_CASE("an undecided record gives cant_tell and a test of the size of its band") {
  const nlohmann::json open = verdict_of("r21.csv");
  CHECK(open.at("verdict") == "cant_tell");
  CHECK(open.at("effects").empty());
  CHECK(open.at("cause").is_null());
  CHECK(open.at("grade").is_null());
  CHECK(open.at("reason").get<std::string>().find("about as well") != std::string::npos);
  const nlohmann::json& test = open.at("next_test");
  CHECK(open.at("settle") == test.at("text"));
  // The same text as that of gap.
  CHECK_THAT(
      test.at("text").get<std::string>(),
      Catch::StartsWith("To decide between stiction or backlash and good valve: In manual") &&
          Catch::Contains("Expected change of PV") && Catch::Contains("Permission: "));
  CHECK(test.at("size_in_bands").get<double>() < 3.0);
  CHECK(test.at("size").get<double>() == Approx(test.at("size_in_bands").get<double>() *
                                                test.at("band_percent_of_span").get<double>()));
  CHECK(
      std::set<std::string>{"technician", "operator", "test day"}.contains(test.at("allowed_by")));
  CHECK(test.at("expected").size() >= 2);
}

TEST_CASE("several files of one loop get one verdict, with the windows and the time since") {
  const nlohmann::json loop =
      verdict_of("r21.csv", kRoutine + "r22.csv " + kRoutine + "r23.csv --kind flow");
  CHECK(loop.at("verdict") == "valve_effect");
  CHECK(loop.at("grade") == "seen");
  CHECK(loop.at("kind") == "flow");
  // The first window shows the effect with 0.63, too little for a decision by itself.
  CHECK(loop.at("since_s") == 0.0);
  CHECK(loop.at("since_file").get<std::string>().ends_with("r22.csv"));
  REQUIRE(loop.at("windows").size() == 3);
  CHECK(loop.at("windows").at(1).at("file").get<std::string>().ends_with("r22.csv"));
  CHECK(loop.at("windows").at(1).at("to_s") == 7500.0);
  CHECK(loop.at("windows").at(1).at("band").at("log_odds") > 15.0);
  CHECK(loop.at("windows").at(1).at("probability") > 0.9);
  CHECK(loop.at("windows").at(1).at("verdict") == "valve_effect");
}

TEST_CASE("the page shows the trend, the stuck stretches and PV over CO") {
  const TemporaryFolder folder;
  const std::string page = (folder / "page.html").string();
  CHECK(loopwarden("diagnose " + kRoutine + "r22.csv --report " + page).exit_code == 0);
  const std::string text = read_file(page);
  CHECK(text.find("CO moves, the valve does not") != std::string::npos);
  CHECK(text.find("PV over CO") != std::string::npos);
  CHECK(text.find("band of 30 %") != std::string::npos);
  CHECK(loopwarden("diagnose " + kRoutine + "r22.csv --report /nonexistent/x.html").exit_code ==
        74);
}

TEST_CASE("the band is drawn after dead time and lag, with marks while the valve rests",
          "[diagnosis]") {
  constexpr std::size_t kSamples = 1000;
  constexpr std::size_t kDead = 12;
  constexpr double kBand = 4.0;
  std::vector<double> co(kSamples);
  std::vector<double> valve(kSamples);
  std::vector<double> pv(kSamples);
  effects::Backlash play(kBand);
  double lagged = 50.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    co[k] = 50.0 + 5.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(k) / 100.0);
    if (k == 0) play.reset(co[0]);
    valve[k] = play.step(co[k]);
    lagged += 0.1 * ((k >= kDead ? valve[k - kDead] : 50.0) - lagged);
    pv[k] = 100.0 + 2.0 * lagged;
  }
  const workbench::ValveView view = workbench::valve_view(pv, co, kBand);
  double miss = 0.0;
  std::size_t marked_wrong = 0;
  for (std::size_t k = 200; k < kSamples; ++k) {
    miss = std::max(miss, std::abs(view.followed[k] - pv[k]));
    marked_wrong += std::isfinite(view.standing[k]) != (valve[k] == valve[k - 1]) ? 1U : 0U;
  }
  CHECK(marked_wrong == 0);
  // PV swings by 8.5 in both directions.
  CHECK(miss < 1.0);
  CHECK(view.dead_time > 0);
}

TEST_CASE("wrong usage and bad records give their exit codes") {
  const TemporaryFolder folder;
  CHECK(loopwarden("diagnose").exit_code == 64);
  CHECK(loopwarden("diagnose " + kRoutine + "r22.csv --co-range 10 5").exit_code == 64);
  CHECK(loopwarden("diagnose " + kRoutine + "r22.csv --co-range 10").exit_code == 64);
  CHECK(loopwarden("diagnose /nonexistent.csv").exit_code == 74);
  write_file(folder / "no_co.csv", "time,pv\n0,1\n1,2\n2,3\n");
  const ShellOutcome without = loopwarden("diagnose " + (folder / "no_co.csv").string());
  CHECK(without.exit_code == 65);
  CHECK(without.text.find("no column 'co'") != std::string::npos);
  CHECK(without.text.find("loopwarden classify") != std::string::npos);
  CHECK(loopwarden("diagnose " + kRoutine + "r22.csv --kind river").exit_code == 64);
  write_file(folder / "tiny.csv", "time,pv,co\n0,1,5\n1,2,6\n2,3,5\n");
  const ShellOutcome tiny = loopwarden("diagnose --json " + (folder / "tiny.csv").string());
  CHECK(tiny.exit_code == 0);
  const nlohmann::json result = nlohmann::json::parse(tiny.text);
  CHECK(result.at("verdict") == "not_enough_data");
  CHECK(result.at("effects").empty());
  CHECK(result.at("oscillating") == false);
  CHECK(result.at("period_s").is_null());
}

TEST_CASE("the pictures show the record's own times, also after a cut-off beginning",
          "[diagnosis]") {
  constexpr std::size_t kDead = 300;
  constexpr double kPeriod_s = 2.0;
  numeric::Random random(5);
  std::vector<double> pv(1000);
  std::vector<double> co(1000);
  for (std::size_t k = 0; k < pv.size(); ++k) {
    co[k] = 50.0 + 10.0 * std::sin(0.05 * static_cast<double>(k));
    pv[k] =
        k < kDead ? std::numeric_limits<double>::quiet_NaN() : 0.5 * co[k] + 0.1 * random.normal();
  }
  const workbench::DiagnosedWindow window{
      .file = "FIC-1.csv",
      .from_s = 40.0,
      .to_s = 40.0 + 999.0 * kPeriod_s,
      .period_s = kPeriod_s,
      .diagnosis = diagnosis::diagnose({.period_s = kPeriod_s, .pv = pv, .co = co}, {})};
  const std::vector<double> times = workbench::sample_times(window);
  REQUIRE(times.size() == window.diagnosis.prepared.raw_pv.size());
  CHECK(times.front() == 40.0 + kDead * kPeriod_s);
  CHECK(times.back() == window.to_s);
}

}  // namespace
}  // namespace loopwarden::tests::diagnose_test
