// SPDX-License-Identifier: Apache-2.0
// A script replaces `loopwarden` here. The tests check its arguments, its exit and its duration.
#include "daemon/explain/explainer.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/explain/explanation_file.hpp"
#include "daemon/explain/pending_explanation.hpp"
#include "record/record_csv.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::explainer_test {
namespace {

namespace fs = std::filesystem;
using alarm::AlarmKind;

constexpr const char* kExplanation = R"({"alarm": "stiction", "final_name": "model_gap",
  "raised_ms": 1, "ended_ms": 2, "verdict": "missing_effect", "gap_closed": 0.97, "agrees": true,
  "from_s": -120.0, "to_s": 300.0, "sentence": "The gain has changed.",
  "next_test": {"text": "To decide: move SP."},
  "first": {"name": "gain_change", "number": 7, "size_percent": null, "low_percent": null,
            "high_percent": null, "confidence": 0.94, "alternatives": ["leakage"],
            "remedy": "Find out why."}, "effects": []})";

// A copy of minutes.csv would have this content: three samples, the alarm at the second.
supervision::History::Minutes minutes() {
  return {{.period_s = 0.5, .pv = {2, 3, 4}, .sp = {1, 1, 1}, .co = {5, 6, 7}}, 42};
}

struct Bench {
  explicit Bench(const std::string& script) {
    program = folder / "fake";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(program, fs::perms::owner_all);
    fs::create_directory(folder / "evidence");
  }
  Explainer make(ExplainerSettings settings = {}) {
    settings.program = program;
    return {settings,
            [this](std::size_t) {
              const std::lock_guard lock(mutex);
              return now;
            },
            [this](const ExplainJob& job, const Explanation* e, const std::string& why) {
              const std::lock_guard lock(mutex);
              reports.push_back({job, e != nullptr ? *e : Explanation{}, why});
              changed.notify_all();
            }};
  }
  ExplainJob job(std::size_t loop = 3) const {
    return {
        .loop = loop, .alarm = AlarmKind::stiction, .raised_at = 40, .folder = folder / "evidence"};
  }
  bool wait(std::size_t count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(60),
                            [&] { return reports.size() >= count; });
  }
  template <class Until>
  static bool wait_until(Until until) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!until() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return until();
  }
  struct Report {
    ExplainJob job;
    Explanation explanation;
    std::string why;
  };
  tests::TemporaryFolder folder;
  fs::path program;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Report> reports;
  supervision::History::Minutes now = minutes();
};

}  // namespace

TEST_CASE("an alarm's minutes are written with time from the alarm, and the answer is read",
          "[explain]") {
  Bench bench(
      "[ \"$1 $2\" = 'explain --background' ] || exit 3\ncat > \"$3/explanation.json\" <<'J'\n" +
      std::string(kExplanation) + "\nJ");
  Explainer explainer = bench.make();
  explainer.start();
  explainer.post(bench.job());
  REQUIRE(bench.wait(1));
  const Bench::Report& report = bench.reports.front();
  CHECK(report.why.empty());
  CHECK(report.job.loop == 3);
  CHECK(report.explanation.alarm == AlarmKind::stiction);
  CHECK(report.explanation.final_name == AlarmKind::model_gap);
  CHECK(report.explanation.effect == "gain_change");
  CHECK(report.explanation.effect_number == 7);
  CHECK(report.explanation.gap_closed == 0.97);
  CHECK(report.explanation.since_s == 120.0);
  CHECK(std::isnan(report.explanation.size_percent));
  CHECK(report.explanation.alternatives == std::vector<std::string>{"leakage"});
  const record::Record record = record::read_record(bench.folder / "evidence/minutes.csv");
  CHECK(record.time_s == std::vector<double>{-0.5, 0.0, 0.5});
  CHECK(record.pv == std::vector<double>{2, 3, 4});
  CHECK(record.sp == std::vector<double>{1, 1, 1});
  CHECK(record.co == std::vector<double>{5, 6, 7});
  CHECK(explainer.status().explained == 1);
}

TEST_CASE("a child that fails, dies or answers nonsense is reported with a reason", "[explain]") {
  const auto [script, most_s, why] = GENERATE(table<std::string, int, std::string>(
      {{"exit 65", 60, "ended with 65"},
       {"kill -9 $$", 60, "ended with 137"},
       {"exit 0", 60, "missing or unreadable"},
       {"echo '{\"alarm\": 3}' > \"$3/explanation.json\"", 60, "unknown alarm"},
       {"exec sleep 600", 1, "not finished within 1 s"}}));
  Bench bench(script);
  Explainer explainer = bench.make({.program = {}, .most_time = std::chrono::seconds(most_s)});
  explainer.start();
  explainer.post(bench.job());
  REQUIRE(bench.wait(1));
  CHECK_THAT(bench.reports.front().why, Catch::Contains(why));
  CHECK(explainer.status().failed == 1);
  CHECK(explainer.status().explained == 0);
}

TEST_CASE("one job at a time, each when its minutes are recorded; a full queue is reported",
          "[explain]") {
  Bench bench("echo start >> \"$3/../log\"; sleep 0.3; echo end >> \"$3/../log\"; exit 1");
  Explainer explainer = bench.make({.program = {}, .most_waiting = 2});
  ExplainJob late = bench.job(0);
  late.wait = std::chrono::milliseconds(5000);
  explainer.post(late);
  explainer.post(bench.job(1));
  explainer.post(bench.job(2));  // no room
  REQUIRE(bench.reports.size() == 1);
  CHECK(bench.reports[0].job.loop == 2);
  CHECK_THAT(bench.reports[0].why, Catch::Contains("2 explanations are waiting"));
  explainer.start();
  REQUIRE(bench.wait(3));
  CHECK(bench.reports[1].job.loop == 1);
  CHECK(bench.reports[2].job.loop == 0);
  CHECK(tests::read_file(bench.folder / "log") == "start\nend\nstart\nend\n");
}

TEST_CASE(
    "a waiting job is on the disk from the start, and continues after a restart with the saved "
    "data",
    "[explain]") {
  Bench bench("cat > \"$3/explanation.json\" <<'J'\n" + std::string(kExplanation) + "\nJ");
  const fs::path evidence = bench.folder / "evidence";
  {
    Explainer before = bench.make();
    before.start();
    ExplainJob job = bench.job();
    job.wait = std::chrono::hours(1);
    job.enough_s = 1.0;
    before.post(job);
    REQUIRE(Bench::wait_until([&] { return read_pending(evidence).has_value(); }));
    CHECK(read_pending(evidence)->there_s == 1.0);
    {
      const std::lock_guard lock(bench.mutex);
      bench.now.pv.push_back(5);
      bench.now.sp.push_back(1);
      bench.now.co.push_back(8);
      ++bench.now.end;
    }
    before.stop();  // saves the last samples
    CHECK(bench.reports.empty());
  }
  CHECK(record::read_record(evidence / "minutes.csv").pv == std::vector<double>{2, 3, 4, 5});
  const auto pending = read_pending(evidence);
  REQUIRE(pending);
  CHECK(pending->there_s == 1.5);
  CHECK(pending->enough_s == 1.0);

  bench.now = {};  // another run of the loop
  Explainer after = bench.make();
  after.start();
  ExplainJob job = bench.job();
  job.raised_at = 0;
  job.enough_s = pending->enough_s;
  job.resumed_s = pending->there_s;
  after.post(job);
  REQUIRE(bench.wait(1));
  CHECK(bench.reports.front().why.empty());
  CHECK(bench.reports.front().explanation.effect == "gain_change");
  CHECK(record::read_record(evidence / "minutes.csv").pv == std::vector<double>{2, 3, 4, 5});
  CHECK_FALSE(read_pending(evidence));
}

TEST_CASE("a restart that cuts the minutes short is reported if they explain too little",
          "[explain]") {
  const bool cut = GENERATE(true, false);
  Bench bench(R"(cat > "$3/explanation.json" <<'J'
{"alarm": "stiction", "final_name": null, "raised_ms": 1, "ended_ms": 2, "verdict": "not_explained",
 "gap_closed": null, "agrees": false, "from_s": null, )"
              R"("sentence": "Too little moves.", "first": null}
J)");
  Explainer explainer = bench.make();
  explainer.start();
  ExplainJob job = bench.job();
  job.enough_s = 600.0;
  job.resumed_s = cut ? 150.0 : 600.0;
  explainer.post(job);
  REQUIRE(bench.wait(1));
  CHECK(bench.reports.front().why.empty());
  const std::string sentence = bench.reports.front().explanation.sentence;
  if (cut) {
    CHECK(sentence ==
          "Not explained: the restart of the daemon left too few minutes (2.5 min after the alarm, "
          "10.0 min are required). Too little moves.");
  } else {
    CHECK(sentence == "Too little moves.");
  }
  // The folder has the same text.
  CHECK(read_explanation(bench.folder / "evidence").sentence == sentence);
}

TEST_CASE("minutes that a restart cut short are collected again from the next run", "[explain]") {
  Bench bench("if grep -q 55 \"$3/minutes.csv\"; then cat > \"$3/explanation.json\" <<'J'\n" +
              std::string(kExplanation) +
              R"(
J
else cat > "$3/explanation.json" <<'J'
{"alarm": "stiction", "final_name": null, "raised_ms": 1, "ended_ms": 2, "verdict": "not_explained",
 "gap_closed": null, "agrees": false, "from_s": null, )"
              R"("sentence": "Too little moves.", "first": null}
J
fi)");
  const fs::path evidence = bench.folder / "evidence";
  tests::write_file(evidence / "minutes.csv", "time,pv\n0,1\n");
  bench.now = {{.period_s = 0.5, .pv = {55, 56}, .sp = {1, 1}, .co = {5, 6}}, 9};
  Explainer explainer = bench.make();
  explainer.start();
  ExplainJob job = bench.job();
  job.raised_at = 0;
  job.enough_s = 600.0;
  job.resumed_s = 150.0;
  job.again = std::chrono::milliseconds(1);
  explainer.post(job);
  REQUIRE(bench.wait(1));
  CHECK(bench.reports.front().why.empty());
  CHECK(bench.reports.front().explanation.effect == "gain_change");
  CHECK(record::read_record(evidence / "minutes.csv").time_s == std::vector<double>{0.0, 0.5});
  CHECK(explainer.status().explained == 1);
}

TEST_CASE("a history that restarted after the alarm does not replace the minutes that were saved",
          "[explain]") {
  Bench bench("cat > \"$3/explanation.json\" <<'J'\n" + std::string(kExplanation) + "\nJ");
  const fs::path evidence = bench.folder / "evidence";
  {
    Explainer explainer = bench.make();
    explainer.start();
    ExplainJob job = bench.job();
    job.wait = std::chrono::hours(1);
    explainer.post(job);
    REQUIRE(Bench::wait_until([&] { return read_pending(evidence).has_value(); }));
    const std::lock_guard lock(bench.mutex);
    bench.now = {{.period_s = 0.5, .pv = {9}, .sp = {1}, .co = {9}}, 100};
  }
  CHECK(record::read_record(evidence / "minutes.csv").pv == std::vector<double>{2, 3, 4});
}

TEST_CASE("repeats count towards the limit, but run after every first explanation", "[explain]") {
  Bench bench("exit 1");
  Explainer explainer = bench.make({.program = {}, .most_waiting = 3});
  const auto repeat = [&](std::size_t loop) {
    ExplainJob job = bench.job(loop);
    job.repeat = true;
    return job;
  };
  explainer.post(repeat(0));
  explainer.post(repeat(1));
  explainer.post(bench.job(2));
  explainer.post(repeat(3));  // no room
  CHECK(explainer.status().waiting == 3);
  explainer.post(bench.job(4));  // replaces job 1
  CHECK(explainer.status().waiting == 3);
  CHECK(explainer.status().failed == 2);
  CHECK(bench.reports.empty());
  explainer.start();
  REQUIRE(bench.wait(3));
  explainer.stop();
  std::vector<std::size_t> loops;
  for (const Bench::Report& report : bench.reports) loops.push_back(report.job.loop);
  CHECK(loops == std::vector<std::size_t>{2, 4, 0});
}

TEST_CASE("a running explanation takes no room in the queue, nor does its repeat", "[explain]") {
  Bench bench("exit 1");
  std::mutex mutex;
  Explainer* explainer = nullptr;
  std::vector<std::size_t> waiting;
  Explainer made{{.program = bench.program, .most_waiting = 1},
                 [](std::size_t) { return minutes(); },
                 [&](const ExplainJob& job, const Explanation*, const std::string&) {
                   if (!job.repeat) {
                     ExplainJob next = job;
                     next.repeat = true;
                     next.wait = std::chrono::hours(1);
                     explainer->post(next);
                   }
                   const std::lock_guard lock(mutex);
                   waiting.push_back(explainer->status().waiting);
                 }};
  explainer = &made;
  made.post(bench.job());
  made.start();
  REQUIRE(
      Bench::wait_until([&] { return made.status().failed == 1 && made.status().waiting == 1; }));
  made.stop();
  CHECK(waiting == std::vector<std::size_t>{2});
}

TEST_CASE("a repeat is not kept for a restart, and can be cancelled", "[explain]") {
  Bench bench("cat > \"$3/explanation.json\" <<'J'\n" + std::string(kExplanation) + "\nJ");
  Explainer explainer = bench.make();
  ExplainJob later = bench.job(1);
  later.repeat = true;
  later.wait = std::chrono::hours(1);
  explainer.post(later);
  ExplainJob over = bench.job(2);
  over.repeat = true;
  over.wanted = [] { return false; };
  explainer.post(over);
  explainer.post(bench.job(3));
  explainer.start();
  REQUIRE(bench.wait(1));
  CHECK(bench.reports.front().job.loop == 3);
  CHECK(bench.reports.front().why.empty());
  REQUIRE(Bench::wait_until([&] { return explainer.status().waiting == 1; }));
  explainer.stop();
  CHECK(bench.reports.size() == 1);
  CHECK_FALSE(read_pending(bench.folder / "evidence"));
}

TEST_CASE("the end of the daemon does not wait for an explanation", "[explain]") {
  Bench bench("exec sleep 600");
  Explainer explainer = bench.make();
  explainer.start();
  explainer.post(bench.job());
  explainer.post(bench.job());
  REQUIRE(Bench::wait_until([&] { return explainer.status().waiting == 2; }));
  CHECK(explainer.stop_for(std::chrono::seconds(60)));
  CHECK(bench.reports.empty());
}

TEST_CASE("other work is done between explanations, and is interrupted for one that is due",
          "[explain]") {
  Bench bench("echo explained >> \"$3/../log\"; exit 1");
  std::atomic<int> left = 2;
  std::atomic<bool> at_work = false;
  const auto spare = [&](const StopWork& stop) {
    if (left == 0) return false;
    std::ofstream(bench.folder / "log", std::ios::app) << "begun\n";
    at_work = true;
    // The first call runs until it is asked to stop.
    if (left-- == 2) {
      while (!stop(std::chrono::milliseconds(100))) {
      }
    }
    return true;
  };
  Explainer explainer = bench.make({.program = {}, .spare = spare});
  ExplainJob late = bench.job(1);
  late.wait = std::chrono::hours(1);
  explainer.post(late);
  explainer.start();
  CHECK(test::eventually([&] { return at_work.load(); }));
  explainer.post(bench.job(2));
  REQUIRE(bench.wait(1));
  CHECK(test::eventually([&] { return left == 0; }));
  explainer.stop();
  CHECK(bench.reports.size() == 1);
  CHECK(tests::read_file(bench.folder / "log") == "begun\nexplained\nbegun\n");
}

TEST_CASE("other work begins on request, and waiting minutes are saved meanwhile", "[explain]") {
  Bench bench("exit 1");
  std::atomic<bool> wanted = false;
  std::atomic<bool> at_work = false;
  const auto spare = [&](const StopWork& stop) {
    if (!wanted.exchange(false)) return false;
    at_work = true;
    while (!stop(std::chrono::milliseconds(1))) {
    }
    return true;
  };
  Explainer explainer =
      bench.make({.program = {}, .save = std::chrono::milliseconds(10), .spare = spare});
  explainer.start();
  wanted = true;
  explainer.wake();
  CHECK(test::eventually([&] { return at_work.load(); }));
  ExplainJob late = bench.job();
  late.wait = std::chrono::hours(1);
  explainer.post(late);
  CHECK(test::eventually([&] { return read_pending(bench.folder / "evidence").has_value(); }));
  CHECK(explainer.stop_for(std::chrono::seconds(60)));
}

TEST_CASE("without the workbench no job is explained", "[explain]") {
  Bench bench("exit 0");
  bench.program.clear();
  Explainer explainer = bench.make();
  explainer.start();
  explainer.post(bench.job());
  CHECK(explainer.status().waiting == 0);
}

}  // namespace loopwarden::daemon::explainer_test
