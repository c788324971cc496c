// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "daemon/console/loop_commands.hpp"
#include "daemon/console/operations.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/console/test_sessions.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

using SessionClock = std::function<Commissioning::Clock::time_point()>;

// Takes loops out of service for a session (`commissioning`). A session that shows no sign of life
// ends with the stop action of its loop, or after a test with the loop's state from before it.
class SessionCommands {
 public:
  SessionCommands(const Plant& plant, journal::Journal& journal, LoopCommands& commands,
                  const Operations& operations, SessionClock clock)
      : plant_(plant),
        journal_(journal),
        commands_(commands),
        clock_(std::move(clock)),
        tests_(plant, journal, commands, operations) {}

  // Begins, prolongs or ends a session, and moves the loop of a test. Throws RequestError.
  protocol::Commissioning commissioning(const protocol::CommissioningRequest& request,
                                        const Sender& sender);
  // Stores the decision of a test.
  base::LocalServer::Answer test_result(const protocol::TestResultRequest& request,
                                        const Sender& sender);
  // Ends silent sessions, and tests that must end.
  void end_sessions(Commissioning::Clock::time_point now);

 private:
  // The stop action of a silent session.
  struct Ending {
    std::optional<std::uint64_t> command{};  // without an answer yet
    std::string refused{};                   // reason of the last refusal
    Commissioning::Clock::time_point next{};
  };
  protocol::Commissioning in_test(const protocol::CommissioningRequest& request, std::size_t loop);
  void check_withholding(const protocol::CommissioningRequest& request, std::size_t loop);
  void withhold(std::size_t loop, double seconds, const std::string& peer);
  void write_down(std::size_t loop, bool begun, const std::string& peer);
  void end_silent(std::size_t loop, Commissioning::Clock::time_point now);
  rt::Command stop_command(std::size_t loop) const;

  Plant plant_;
  journal::Journal& journal_;
  LoopCommands& commands_;
  SessionClock clock_;
  TestSessions tests_;
  std::map<std::size_t, Ending> endings_;  // by loop
};

}  // namespace loopwarden::daemon::console
