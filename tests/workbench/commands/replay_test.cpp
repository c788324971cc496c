// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "model/watch/loop_monitor.hpp"
#include "config/evidence_file/evidence_file.hpp"
#include "model/watch/limits.hpp"
#include "record/record_csv.hpp"
#include "tests/support/biased_specialists.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::replay_test {
namespace {

using nlohmann::json;

ShellOutcome replay(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " replay " + arguments + " 2>&1");
}

// A moving loop with `samples` samples at 10 Hz. `spoil` can change the PV and CO cells of a row.
struct Bench {
  using Spoil = std::function<void(int, std::string& pv, std::string& co)>;
  std::string record(int samples, const Spoil& spoil = {}) const {
    std::string text = "time,pv,sp,co\n";
    for (int k = 0; k < samples; ++k) {
      const double x = 0.02 * k;
      std::string pv = std::to_string(5.0 + std::sin(x) + 0.1 * std::sin(7.3 * x));
      std::string co = std::to_string(4.0 + std::cos(x));
      if (spoil) spoil(k, pv, co);
      text += std::to_string(0.1 * k) + "," + pv + ",5," + co + "\n";
    }
    const std::string file = (folder / "record.csv").string();
    write_file(file, text);
    return file;
  }
  std::string specialists(specialist::Condition always, double period_s = 0.1) const {
    write_biased_specialists(folder / "specialists", always, period_s);
    return " --specialists " + (folder / "specialists").string();
  }
  TemporaryFolder folder;
};

}  // namespace

TEST_CASE("a record replayed through the daemon's monitor raises the alarm with the third window",
          "[replay]") {
  const Bench bench;
  const std::string record = bench.record(4000);
  const std::string specialists = bench.specialists(specialist::Condition::stiction);
  const ShellOutcome out = replay(record + specialists + " --overlap 0 --json");
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  const json result = json::parse(out.text);
  CHECK(result.at("windows") == 4);
  CHECK(result.at("suppressed_windows") == 0);
  REQUIRE(result.at("transitions").size() == 1);
  const json& t = result.at("transitions")[0];
  CHECK(t.at("alarm") == "stiction");
  CHECK(t.at("from") == "normal");
  CHECK(t.at("to") == "unacknowledged");
  CHECK(t.at("time_s") == Approx(0.1 * (3 * 961 - 1)));
  REQUIRE(result.at("incidents").size() == 1);
  const json& incident = result.at("incidents")[0];
  CHECK(incident.at("id") == "record-288.2");
  CHECK(incident.at("raised_s") == t.at("time_s"));
  CHECK(incident.at("name") == "stiction");
  CHECK(incident.at("cause") == "valve");
  CHECK(incident.at("confidence").is_null());
  CHECK(incident.at("alarms") == json{"stiction"});
  CHECK(incident.at("cleared_s").is_null());
  CHECK(replay(record + specialists).text.find("unacknowledged") != std::string::npos);
  CHECK(replay(record + specialists + " --json").text ==
        replay(record + specialists + " --json").text);
}

TEST_CASE("the size of an unknown fault is null in JSON and - in the list", "[replay]") {
  const Bench bench;
  const std::string arguments =
      bench.record(4000) + bench.specialists(specialist::Condition::other);
  const ShellOutcome out = replay(arguments + " --json");
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  const json result = json::parse(out.text);
  REQUIRE(result.at("transitions").size() == 1);
  CHECK(result.at("transitions")[0].at("alarm") == "unknown");
  CHECK(result.at("transitions")[0].at("severity_percent").is_null());
  CHECK(replay(arguments).text.find(" % ") == std::string::npos);
}

TEST_CASE("a healthy loop has no alarm", "[replay]") {
  const Bench bench;
  const ShellOutcome out =
      replay(bench.record(4000) + bench.specialists(specialist::Condition::no_fault) + " --json");
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  CHECK(json::parse(out.text).at("transitions").empty());
  CHECK(json::parse(out.text).at("windows") == 7);
}

TEST_CASE("no window spans missing samples, and a saturated window is not judged", "[replay]") {
  const Bench bench;
  const std::string specialists = bench.specialists(specialist::Condition::stiction);
  const auto windows = [&](const Bench::Spoil& spoil) {
    const ShellOutcome out =
        replay(bench.record(2000, spoil) + specialists + " --overlap 0 --json");
    INFO(out.text);
    REQUIRE(out.exit_code == 0);
    return json::parse(out.text);
  };
  json result = windows([](int k, std::string& pv, std::string&) {
    if (k == 1500) pv.clear();
  });
  CHECK(result.at("windows") == 1);
  // One missing cycle is bridged; too many missing cycles in a row are not.
  for (const int missing : {4, 5}) {
    result = windows([missing](int k, std::string& pv, std::string& co) {
      if (k < 1500 || k >= 1500 + missing) return;
      pv.clear();
      co.clear();
    });
    CHECK(result.at("windows") == (missing == 4 ? 2 : 1));
  }
  result = windows([](int k, std::string&, std::string& co) {
    if (k >= 400 && k < 600) co = "10";
  });
  CHECK(result.at("windows") == 2);
  CHECK(result.at("suppressed_windows") == 1);
}

TEST_CASE("without specialists only routine evidence is used, and the output shows it",
          "[replay]") {
  // Three windows of a real loop with a sticking valve, joined.
  const Bench bench;
  std::string joined = "time,sp,pv,co\n";
  int row = 0;
  for (const char* part : {"r22", "r23", "r22"}) {
    const std::string text =
        read_file(LOOPWARDEN_SOURCE_DIR "/examples/routine/" + std::string(part) + ".csv");
    std::istringstream lines(text.substr(text.find('\n') + 1));
    for (std::string line; std::getline(lines, line);) {
      joined += std::to_string(10 * row++) + line.substr(line.find(',')) + "\n";
    }
  }
  write_file(bench.folder / "b.csv", joined);
  const ShellOutcome outcome = replay((bench.folder / "b.csv").string() + " --json");
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  const json result = json::parse(outcome.text);
  CHECK(result.at("windows") == result.at("suppressed_windows"));
  CHECK(result.at("routine_windows").get<int>() >= 3);
  REQUIRE(result.at("transitions").size() == 1);
  CHECK(result.at("transitions")[0].at("alarm") == "stiction");
  CHECK(result.at("transitions")[0].at("to") == "unacknowledged");
  CHECK(result.at("transitions")[0].at("reason") == "routine");
}

TEST_CASE("replayed routine evidence has the same verdict; a different one is reported",
          "[replay]") {
  // The same valve, watched without specialists, until its alarm would be raised.
  const TemporaryFolder folder;
  watch::WindowSettings settings{.sample_time_s = 10.0};
  watch::LoopMonitor watch(settings, alarm::kAlarmRule, nullptr);
  evidence::Evidence e;
  e.loop = "FIC-101";
  std::uint64_t period = 0;
  for (const char* part : {"r22", "r23", "r22"}) {
    const record::Record r = record::read_record(LOOPWARDEN_SOURCE_DIR "/examples/routine/" +
                                                 std::string(part) + ".csv");
    for (std::size_t k = 0; k < r.size() && !e.routine; ++k) {
      const watch::MonitorStep step = watch.add({.period_index = period++,
                                                 .sp = r.sp[k],
                                                 .pv = r.pv[k],
                                                 .co = r.co[k],
                                                 .stem = std::nan(""),
                                                 .automatic = true,
                                                 .pv_good = true});
      if (step.routine && step.conditions[alarm::index_of(alarm::AlarmKind::stiction)].on) {
        e.take(watch, step, alarm::AlarmReason::routine);
      }
    }
  }
  REQUIRE(e.routine);
  CHECK(e.pv.size() == 2 * watch::WatchLimits::kRoutineSamples);
  CHECK(e.sample_time_s == 10.0);
  CHECK(e.routine->sum_before > 0.0);
  CHECK(e.routine->sum > e.routine->sum_before);
  const bool changed = GENERATE(false, true);
  if (changed) e.routine->evidence.log_odds += 0.5;
  evidence::write_evidence(e, nullptr, folder / "one");
  const ShellOutcome text = replay((folder / "one").string());
  INFO(text.text);
  CHECK(text.exit_code == (changed ? 65 : 0));
  CHECK_THAT(text.text, Catch::Contains(changed ? "NOT the same verdict." : "\nThe same verdict."));
  CHECK_THAT(text.text, Catch::Contains("stiction of FIC-101"));
  CHECK_THAT(text.text, Catch::Contains("the last 250 min"));
  const ShellOutcome answer = replay((folder / "one").string() + " --json");
  INFO(answer.text);
  const json result = json::parse(answer.text);
  CHECK(result.at("kind") == "routine");
  CHECK(result.at("verdict_now") == "valve_effect");
  CHECK(result.at("same") == !changed);
  CHECK(result.at("severity_percent") == Approx(e.routine->severity_percent));
}

TEST_CASE("a record that can't be replayed is refused with a reason", "[replay]") {
  const Bench bench;
  const std::string record = bench.record(1000);
  CHECK(replay("").exit_code == 64);
  CHECK(replay(record + " --co-range 5 5").exit_code == 64);
  CHECK(replay(bench.folder.path().string()).exit_code == 65);  // no evidence
  CHECK(replay(record + " --specialists /nowhere").exit_code == 78);
  CHECK(replay("/nowhere.csv" + bench.specialists(specialist::Condition::no_fault)).exit_code ==
        74);
  const ShellOutcome other =
      replay(record + bench.specialists(specialist::Condition::no_fault, 0.25));
  CHECK(other.exit_code == 65);
  CHECK(other.text.find("0.25 s") != std::string::npos);
  write_file(bench.folder / "record.csv", "time,pv\n0,1\n0.1,2\n0.2,3\n");
  const ShellOutcome no_co = replay(record + bench.specialists(specialist::Condition::no_fault));
  CHECK(no_co.exit_code == 65);
  CHECK(no_co.text.find("'co'") != std::string::npos);
}

}  // namespace loopwarden::tests::replay_test
