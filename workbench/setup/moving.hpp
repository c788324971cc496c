// SPDX-License-Identifier: Apache-2.0
// What the steps that move a valve have in common: a person who agrees each time, limits, a key that ends it, and a loop that
// is out of service for everybody else meanwhile.
#pragma once

#include <chrono>
#include <string>

#include "daemon/protocol/answers.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {

// As the daemon has it. Throws TestAborted where it has no such loop.
protocol::LoopStatus status_of(DaemonClient& daemon, const std::string& tag);

// Throws TestAborted if the daemon does not run the loop as its file in the folder of the setup is
// now. Each step that moves the valve asks before its questions, and again once the loop is its
// own: then no reload comes in between.
void check_in_force(const Setup& setup, DaemonClient& daemon);

// Whether he typed the tag; else the step is left. Throws TestAborted where nobody sits at a
// terminal, and as check_in_force.
bool agreed(Setup& setup, const std::string& what_moves);

// Limits of a test, which he types; the loop stands within them.
LiveLimits limits_now(Setup& setup, const protocol::LoopStatus& loop);
// Those of PV only, of a loop that another controller runs.
LiveLimits pv_limits_now(Setup& setup, const protocol::LoopStatus& loop);
// Where the output stands. Throws TestAborted if the loop has a fault or is outside of the limits.
double check_inside(const protocol::LoopStatus& loop, const LiveLimits& limits);

const char* word_of(control::Action action) noexcept;

// Any key ends it while this lives.
class AbortKey {
 public:
  explicit AbortKey(Person& person);
  AbortKey(const AbortKey&) = delete;
  AbortKey& operator=(const AbortKey&) = delete;
  ~AbortKey() { person_.watch_keys(false); }
  // Why it must end; empty: it need not.
  std::string pressed();

 private:
  Person& person_;
};

// The loop in the daemon's commissioning mode, given back at the end; where this process dies, the daemon takes the output
// to the stop action after a minute.
class Session {
 public:
  // Throws DaemonRefused where another has it.
  Session(const std::string& socket, std::string tag);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  void alive();  // as often as one likes; throws where the session has ended
  void withhold(double seconds);
  void set(protocol::SetRequest request);
  // For a bench: its orders are the session's, it ends by a key, and a loop that it can't put back is not given back.
  void guard(LiveLimits& limits, AbortKey& key);
  // Is not given back: the daemon takes the output to the stop action after a minute.
  void abandon() noexcept { abandoned_ = true; }

 private:
  DaemonClient daemon_;
  std::string tag_;
  std::uint64_t id_;
  std::chrono::steady_clock::time_point told_;
  bool abandoned_ = false;
};

}  // namespace loopwarden::workbench::setup
