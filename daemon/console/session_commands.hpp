// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "daemon/console/loop_commands.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Takes loops out of service for a session (`commissioning`), and ends a session that shows no sign
// of life with the stop action of its loop.
class SessionCommands {
 public:
  SessionCommands(const Plant& plant, journal::Journal& journal, LoopCommands& commands)
      : plant_(plant), journal_(journal), commands_(commands) {}

  // Begins, prolongs or ends a session. Throws RequestError.
  protocol::Commissioning commissioning(const protocol::CommissioningRequest& request,
                                        const Sender& sender);
  void end_silent(Commissioning::Clock::time_point now);

 private:
  // The stop action of a silent session.
  struct Ending {
    std::optional<std::uint64_t> command{};  // without an answer yet
    std::string refused{};                   // reason of the last refusal
    Commissioning::Clock::time_point next{};
  };
  void check_withholding(const protocol::CommissioningRequest& request, std::size_t loop);
  void withhold(std::size_t loop, double seconds, const std::string& peer);
  void write_down(std::size_t loop, bool begun, const std::string& peer);
  void end_silent(std::size_t loop, Commissioning::Clock::time_point now);
  rt::Command stop_command(std::size_t loop) const;

  Plant plant_;
  journal::Journal& journal_;
  LoopCommands& commands_;
  std::map<std::size_t, Ending> endings_;  // by loop
};

}  // namespace loopwarden::daemon::console
