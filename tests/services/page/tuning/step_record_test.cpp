// SPDX-License-Identifier: Apache-2.0
#include "services/page/tuning/step_record.hpp"

#include <catch2/catch.hpp>

#include "tests/services/page/tuning/recorded_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::step_record_test {
namespace {

using page::tuning::newest_step;
using page::tuning::StepRecord;
using page::tuning::StepWish;

struct Bench {
  TemporaryFolder folder;
  page::history::History history;

  void run(std::vector<std::pair<double, double>> set_point, double seconds,
           const RecordedRun& run = {}) {
    record_run(folder.path(), recorded_plant(std::move(set_point)), seconds, run);
  }
  std::optional<StepRecord> newest(StepWish wish = {}) {
    wish.sample_time_s = 0.5;
    wish.integral_time_s = wish.integral_time_s > 0.0 ? wish.integral_time_s : 10.0;
    wish.now_ms = kRecordStart_ms + 100 * 3'600'000LL;
    return newest_step(history, folder.path(), wish);
  }
};

double at_s(std::int64_t ms) { return static_cast<double>(ms - kRecordStart_ms) / 1000.0; }

TEST_CASE("the newest step is found among others, with the record before and after it") {
  Bench bench;
  bench.run({{0.0, 30.0}, {500.0, 40.0}, {4000.0, 50.0}, {4400.0, 45.0}}, 9000.0);
  const auto record = bench.newest();
  REQUIRE(record);
  CHECK(at_s(record->step_ms) == Approx(4400.0).margin(1.0));
  CHECK(at_s(record->from_ms) == Approx(4350.0).margin(2.0));
  CHECK(at_s(record->to_ms) == Approx(4600.0).margin(2.0));
  CHECK(record->period_s == 0.5);
  CHECK(record->sp.front() == 50.0);
  CHECK(record->sp.back() == 45.0);
  CHECK(record->pv.size() == record->co.size());
  CHECK(record->automatic.front() == 1.0);
}

TEST_CASE("a long stretch is thinned by means") {
  Bench bench;
  bench.run({{0.0, 30.0}, {8000.0, 40.0}}, 20000.0);
  const auto record = bench.newest({.integral_time_s = 400.0});
  REQUIRE(record);
  CHECK(record->period_s == 7.0);  // 10 000 s in 1500 samples
  CHECK(record->pv.size() <= page::tuning::kMostSamples + 1);
  CHECK(record->pv.size() >= page::tuning::kMostSamples * 9 / 10);
  CHECK(record->sp.back() == 40.0);
}

TEST_CASE("a record without a step has no newest step") {
  Bench bench;
  SECTION("a set point that never moved") { bench.run({{0.0, 30.0}}, 2000.0); }
  SECTION("a move too small") { bench.run({{0.0, 30.0}, {500.0, 30.9}}, 2000.0); }
  SECTION("in manual, if SP may follow PV") {
    bench.run({{0.0, 30.0}, {500.0, 40.0}}, 2000.0, {.mode = control::Mode::manual});
  }
  SECTION("over a restart") {
    bench.run({{0.0, 30.0}}, 500.0);
    bench.run({{0.0, 40.0}}, 500.0, {.sequence = 2, .start_ms = kRecordStart_ms + 600'000});
  }
  SECTION("no record") { std::filesystem::create_directories(bench.folder.path()); }
  CHECK_FALSE(bench.newest());
}

TEST_CASE("a restart ends the record, on either side of the step") {
  Bench bench;
  bench.run({{0.0, 30.0}}, 500.0);
  bench.run({{0.0, 30.0}, {20.0, 40.0}}, 100.0,
            {.sequence = 2, .start_ms = kRecordStart_ms + 510'000});
  bench.run({{0.0, 40.0}}, 500.0, {.sequence = 3, .start_ms = kRecordStart_ms + 620'000});
  const auto record = bench.newest();
  REQUIRE(record);
  CHECK(at_s(record->step_ms) == Approx(530.0).margin(1.0));
  CHECK(record->pv.size() == 200);
  CHECK(record->sp.front() == 30.0);
  CHECK(record->sp.back() == 40.0);
}

}  // namespace
}  // namespace loopwarden::tests::step_record_test
