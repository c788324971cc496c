// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/cyclic_runner.hpp"

#include <catch2/catch.hpp>

#include <atomic>
#include <vector>

#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/fake_clock.hpp"

namespace loopwarden::tests::cyclic_runner_test {
namespace {

using daemon::rt::CyclicRunner;
using daemon::rt::LatencyHistogram;

constexpr std::int64_t kTick = 10'000'000;  // 10 ms

struct Paced {
  FakeClock clock;
  CyclicRunner runner{clock, kTick};
  std::atomic<bool> stop{false};
  std::atomic<bool> quit{false};

  void run(std::uint64_t ticks) {
    clock.on_sleep = [this, ticks](std::uint64_t sleeps) { quit = sleeps >= ticks; };
    runner.run(stop, quit);
  }
};

// Returns the records of a loop in the order of their cycles.
std::vector<record::RecordRow> rows_of(Loop& loop) {
  std::vector<record::RecordRow> rows;
  record::RecordRow row;
  while (loop.channels.records.try_pop(row)) rows.push_back(row);
  return rows;
}

TEST_CASE("a loop runs once in each of its periods") {
  Paced paced;
  Loop every_tick;
  Loop every_fourth;
  paced.runner.add(every_tick.cycle, 1);
  paced.runner.add(every_fourth.cycle, 4);
  paced.run(40);
  CHECK(rows_of(every_tick).size() == 40);
  const auto rows = rows_of(every_fourth);
  REQUIRE(rows.size() == 10);
  CHECK(rows[9].period_index == 9);
  CHECK(rows[1].time_ns - rows[0].time_ns == 4 * kTick);
}

TEST_CASE("loops of one period are spread over the ticks") {
  Paced paced;
  Loop a;
  Loop b;
  paced.runner.add(a.cycle, 2);
  paced.runner.add(b.cycle, 2);
  paced.run(10);
  const auto later = rows_of(b);
  CHECK(later.front().time_ns - rows_of(a).front().time_ns == kTick);
  CHECK(later.front().period_index == 0);
  CHECK((later.front().flags & record::kLateCycle) == 0);
}

TEST_CASE("jitter shorter than a tick has no effect and does not add up") {
  Paced paced;
  Loop loop;
  paced.runner.add(loop.cycle, 1);
  paced.clock.late_ns = [](std::uint64_t sleep) {
    return static_cast<std::int64_t>(sleep % 7) * 1'000'000;
  };
  paced.run(1000);
  const auto rows = rows_of(loop);
  REQUIRE(rows.size() == 1000);
  const std::int64_t drift = (rows.back().time_ns - rows.front().time_ns) - 999 * kTick;
  CHECK(drift < kTick);
  CHECK(paced.runner.status().overruns == 0);
}

TEST_CASE(
    "an overrun keeps the phase, is counted, and the loop gets the number of missed periods") {
  Paced paced;
  Loop loop;
  paced.runner.add(loop.cycle, 1);
  paced.clock.late_ns = [](std::uint64_t sleep) { return sleep == 5 ? 3 * kTick + 1000 : 0; };
  paced.run(10);
  const auto rows = rows_of(loop);
  REQUIRE(rows.size() == 10);
  CHECK(rows[4].period_index == 4);
  CHECK(rows[5].period_index == 8);  // 5, 6 and 7 were missed
  CHECK((rows[5].flags & record::kLateCycle) != 0);
  CHECK((rows[6].flags & record::kLateCycle) == 0);
  CHECK((rows[6].time_ns - rows[4].time_ns) % kTick == 0);  // phase kept
  const auto status = paced.runner.status();
  CHECK(status.overruns == 1);
  CHECK(status.skipped_ticks == 3);
  CHECK(status.wake_up.worst_ns == 3 * kTick + 1000);
}

TEST_CASE("the histogram's quantiles bound the recorded values") {
  LatencyHistogram h;
  CHECK(h.quantile_ns(0.5) == 0);
  for (int i = 0; i < 99; ++i) h.add(3'500);  // 3.5 us: bin [2, 4) us
  h.add(900'000);
  CHECK(h.quantile_ns(0.5) == 4'000);
  CHECK(h.quantile_ns(0.99) == 4'000);
  CHECK(h.quantile_ns(1.0) == 900'000);
  h.add(-5);
  CHECK(h.bins[0] == 1);
  h.add(3'000'000'000);
  CHECK(h.bins[LatencyHistogram::kBins - 1] == 1);
}

}  // namespace
}  // namespace loopwarden::tests::cyclic_runner_test
