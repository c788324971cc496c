// SPDX-License-Identifier: Apache-2.0
// Measures the lateness of each wake-up of the daemon's real-time thread with simulated loops, as
// cyclictest does.
// Usage: loopwarden_pacing PERIOD_US PRIORITY WAKE_UPS [LOOPS]
// Prints one line "MICROSECONDS COUNT" for each latency that occurred. tests/system/jitter runs
// both.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "lab/bench/bench_loop.hpp"
#include "lab/bench/plant1.hpp"
#include "daemon/rt/cyclic_runner.hpp"
#include "base/real_time.hpp"
#include "base/thread.hpp"

namespace loopwarden::bench {
namespace {

// Ends the run after a number of wake-ups and stores the first reading of the clock after each.
class NotingClock final : public base::Clock {
 public:
  NotingClock(std::size_t wake_ups, std::atomic<bool>& quit) : quit_(quit) {
    late_us_.reserve(wake_ups);
  }
  std::int64_t now_ns() noexcept override {
    const std::int64_t now = clock_.now_ns();
    if (slept_ && late_us_.size() < late_us_.capacity()) {
      slept_ = false;
      late_us_.push_back((now - deadline_ns_) / 1000);
      if (late_us_.size() == late_us_.capacity()) quit_ = true;
    }
    return now;
  }
  void sleep_until_ns(std::int64_t deadline_ns) noexcept override {
    deadline_ns_ = deadline_ns;
    clock_.sleep_until_ns(deadline_ns);
    slept_ = true;
  }
  std::vector<std::int64_t>& late_us() { return late_us_; }

 private:
  base::MonotonicClock clock_;
  std::atomic<bool>& quit_;
  std::vector<std::int64_t> late_us_;
  std::int64_t deadline_ns_ = 0;
  bool slept_ = false;
};

int run(std::int64_t period_us, int priority, std::size_t wake_ups, int loops) {
  const std::string refused = base::lock_memory();
  std::atomic<bool> stop{false};
  std::atomic<bool> quit{false};
  NotingClock clock(wake_ups, quit);
  daemon::rt::CyclicRunner runner(clock, period_us * 1000);
  base::SpscRing<daemon::rt::Event> events(256);
  std::vector<std::unique_ptr<BenchLoop>> all;
  for (int i = 0; i < loops; ++i) {
    all.push_back(std::make_unique<BenchLoop>(plant1(), events));
    runner.add(all.back()->cycle, 1);
  }
  base::Thread thread;
  const std::string no_priority =
      thread.start({.name = "lw-loops", .fifo_priority = priority}, [&] {
        base::prefault_stack();
        runner.run(stop, quit);
      });
  thread.join();
  if (!refused.empty() || !no_priority.empty()) {
    fmt::print(stderr, "{} {}\n", refused, no_priority);
    return EXIT_FAILURE;
  }
  std::vector<std::int64_t>& late = clock.late_us();
  std::sort(late.begin(), late.end());
  for (auto first = late.begin(); first != late.end();) {
    const auto last = std::upper_bound(first, late.end(), *first);
    fmt::print("{} {}\n", *first, last - first);
    first = last;
  }
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace loopwarden::bench

int main(int argc, char** argv) {
  try {
    if (argc < 4) {
      fmt::print(stderr, "usage: loopwarden_pacing PERIOD_US PRIORITY WAKE_UPS [LOOPS]\n");
      return 64;
    }
    return loopwarden::bench::run(std::stoll(argv[1]), std::stoi(argv[2]),
                                  static_cast<std::size_t>(std::stoll(argv[3])),
                                  argc > 4 ? std::stoi(argv[4]) : 4);
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden_pacing: {}\n", e.what());
    return 64;
  }
}
