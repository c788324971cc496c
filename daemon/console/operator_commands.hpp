// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "base/local_server.hpp"
#include "daemon/console/access.hpp"
#include "daemon/console/alarm_commands.hpp"
#include "daemon/console/loop_commands.hpp"
#include "daemon/console/record_commands.hpp"
#include "daemon/console/reload_commands.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/console/session_commands.hpp"

namespace loopwarden::daemon::console {

// Executes the requests that change something, from a table of commands. Used by the thread of
// control.sock only.
class OperatorCommands {
 public:
  OperatorCommands(
      const Plant& plant, const Archive& archive, const DaemonInfo& info, Operations& operations,
      SessionClock clock = [] { return Commissioning::Clock::now(); });
  OperatorCommands(const OperatorCommands&) = delete;
  OperatorCommands& operator=(const OperatorCommands&) = delete;

  // Returns the access that the command `name` needs; null if there is no such command.
  static const Access* access(std::string_view name) noexcept;

  // Executes the command `name`. Commands about alarms, outcomes, notes and reports answer when the
  // journal has their line on the disk, or when that takes too long. Throws RequestError.
  base::LocalServer::Answer answer(std::string_view name, const nlohmann::json& request,
                                   const Sender& sender);

  // Receives the answers of the loops, and ends sessions, tests and records whose time is over.
  void collect(Commissioning::Clock::time_point now = Commissioning::Clock::now());
  // Records every command without an answer as not taken, because the loops have ended.
  void close() { loops_.close(); }

 private:
  struct Command;
  static const Command* find(std::string_view name) noexcept;

  LoopCommands loops_;
  SessionCommands sessions_;
  RecordCommands records_;
  AlarmCommands alarms_;
  ReloadCommands reloads_;
};

// Returns the access that a request needs. Throws RequestError if there is no such request.
Access access_of(std::string_view request);

}  // namespace loopwarden::daemon::console
