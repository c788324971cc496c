// SPDX-License-Identifier: Apache-2.0
// Common parts of the steps that move a valve: the consent of the person each time, limits, a key
// that aborts, and a loop that is out of service for all others meanwhile.
#pragma once

#include <chrono>
#include <string>

#include "daemon/protocol/answers.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {

// Returns the daemon's status of the loop. Throws TestAborted if the daemon does not have the loop.
protocol::LoopStatus status_of(DaemonClient& daemon, const std::string& tag);

// Throws TestAborted if the daemon does not run the loop as its file in the setup's folder is now.
// Each step that moves the valve checks this before its questions. It checks again after it has
// taken the loop, because then a reload is no longer possible.
void check_in_force(const Setup& setup, DaemonClient& daemon);

// Returns whether the person typed the tag. Otherwise the step ends. Throws TestAborted without a
// terminal, and as check_in_force.
bool agreed(Setup& setup, const std::string& what_moves);

// Asks for the limits of a test. The present values of the loop must be within them.
LiveLimits limits_now(Setup& setup, const protocol::LoopStatus& loop);
// Asks only for the limits of PV, for a loop that another controller runs.
LiveLimits pv_limits_now(Setup& setup, const protocol::LoopStatus& loop);
// Returns the present output. Throws TestAborted if the loop has a fault or is outside of the
// limits.
double check_inside(const protocol::LoopStatus& loop, const LiveLimits& limits);

const char* word_of(control::Action action) noexcept;

// Detects any pressed key during its lifetime.
class AbortKey {
 public:
  explicit AbortKey(Person& person);
  AbortKey(const AbortKey&) = delete;
  AbortKey& operator=(const AbortKey&) = delete;
  ~AbortKey() { person_.watch_keys(false); }
  // Returns why the test must end; empty: no key was pressed.
  std::string pressed();

 private:
  Person& person_;
};

// Takes the loop out of service in the daemon and releases it at the end. If this process dies, the
// daemon takes the output to the stop action after one minute.
class Session {
 public:
  // Throws DaemonRefused if another session has the loop.
  Session(const std::string& socket, std::string tag);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  void alive();  // at any rate; throws if the session has ended
  void withhold(double seconds);
  void set(protocol::SetRequest request);
  // Prepares the limits of a bench: it sends its commands in this session and ends when a key is
  // pressed. If the bench can't restore the loop, the session is abandoned.
  void guard(LiveLimits& limits, AbortKey& key);
  // Keeps the loop out of service at the end. The daemon takes the output to the stop action after
  // one minute.
  void abandon() noexcept { abandoned_ = true; }

 private:
  DaemonClient daemon_;
  std::string tag_;
  std::uint64_t id_;
  std::chrono::steady_clock::time_point told_;
  bool abandoned_ = false;
};

}  // namespace loopwarden::workbench::setup
