// SPDX-License-Identifier: Apache-2.0
// Carries out a proposed test of a loop for an engineer at the page, and judges it.
//
// The daemon checks each move and restores the loop. This process shows the signs of life. The test
// ends if the engineer's browser has not shown it for 60 s, because a closed page can't stop it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/thread.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/planned_test/judged_test.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::page::planned_test {

// A test with the files of its planning.
struct WantedTest {
  protocol::TestPlanFile plan;
  plant::LoopModel model;
  record::Record record;
  protocol::Person person;
};

struct TestState {
  enum class Phase : std::uint8_t { moving, restoring, judging, over };
  Phase phase = Phase::moving;
  std::string loop;
  std::string by;
  double duration_s = 0.0;  // of the loop's time
  protocol::TestProgress now{};
  std::string ended_early;  // the reason; empty: to its end
  bool restored = false;    // the daemon has released the loop
  std::string sentence;     // the decision
};

// Thread-safe. One test at a time.
class TestRunner {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kUnseen{60};

  // `daemon`: status.sock; `orders`: page.sock.
  TestRunner(protocol::Daemon& daemon, protocol::Daemon& orders,
             std::function<Clock::time_point()> clock = Clock::now)
      : daemon_(daemon), orders_(orders), clock_(std::move(clock)) {}
  TestRunner(const TestRunner&) = delete;
  TestRunner& operator=(const TestRunner&) = delete;
  ~TestRunner() { stop_for(std::chrono::seconds(60)); }

  // Returns why the loop is not fit for the plan at present; empty: it is. Throws DaemonError.
  std::string why_not(const protocol::TestPlanFile& plan);
  // Returns false if a test runs already.
  bool start(WantedTest test);
  // Ends the test of this loop. Returns false if no test moves it.
  bool stop(const std::string& loop, const std::string& why);
  // Returns the newest test of the loop. `follows`: for the user who watches it.
  std::optional<TestState> state(const std::string& loop, bool follows);
  // Ends the test, and waits for the thread. Returns false if it still runs.
  bool stop_for(std::chrono::milliseconds patience);

 private:
  void run(const WantedTest& test);
  std::string watch(const protocol::TestProgress& now);
  void change(const std::function<void(TestState&)>& how);

  protocol::Daemon& daemon_;
  protocol::Daemon& orders_;
  std::function<Clock::time_point()> clock_;
  std::mutex mutex_;
  std::optional<TestState> state_;
  std::string stop_;  // the reason; empty: it continues
  bool quits_ = false;
  Clock::time_point seen_{};
  base::Thread thread_;
};

}  // namespace loopwarden::page::planned_test
