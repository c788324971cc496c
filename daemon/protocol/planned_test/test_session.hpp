// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::protocol {

// A session in which the daemon moves one loop. However it ends, the daemon restores the loop, also
// after 60 s without a sign of life.
class TestSession {
 public:
  // `person`: who carries out the test, on page.sock. Throws DaemonError.
  TestSession(Daemon& daemon, std::string loop, const TestTerms& terms, const Person& person = {});
  TestSession(const TestSession&) = delete;
  TestSession& operator=(const TestSession&) = delete;
  ~TestSession();

  // Moves SP or the output. Returns false if the loop has not taken the last move yet. Throws
  // DaemonError.
  bool move(double to);
  // Shows a sign of life, at most every 5 s. Throws DaemonError with the reason if the daemon has
  // ended the test.
  void alive();
  // `why`: why it ends early; empty: as planned.
  void end(const std::string& why = {});

 private:
  CommissioningRequest request() const;

  Daemon& daemon_;
  std::string loop_;
  Person person_;
  std::uint64_t session_ = 0;  // 0: ended
  std::chrono::steady_clock::time_point told_;
};

// Waits until the daemon has restored and released the loop, for at most 45 s, or until `leave`
// returns true. Returns false if it has not.
bool wait_released(Daemon& daemon, const std::string& loop, const std::function<bool()>& leave);
// Returns the daemon's status of a loop. Throws std::runtime_error if there is no such loop.
LoopStatus loop_of_daemon(Daemon& daemon, const std::string& tag);

}  // namespace loopwarden::protocol
