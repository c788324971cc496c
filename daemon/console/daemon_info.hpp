// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/gateway/map_values.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

// State and configuration of the whole daemon. Any thread.
class DaemonInfo {
 public:
  DaemonInfo() = default;
  DaemonInfo(const DaemonInfo&) = delete;
  DaemonInfo& operator=(const DaemonInfo&) = delete;
  virtual ~DaemonInfo() = default;

  virtual protocol::DaemonStatus status() const = 0;
  virtual protocol::Description description() const = 0;  // without the loops
  virtual protocol::Links links() const = 0;
  virtual std::filesystem::path configuration() const = 0;  // the folder, absolute
  virtual std::uint32_t config_hash() const = 0;            // of the configuration in force
  // Text of the loop's twin; empty: the loop has no twin.
  virtual std::string twin(std::size_t loop) const = 0;
  // Values of the box and state of the Modbus server, as the register map shows them.
  virtual gateway::BoxReading box() const = 0;
  virtual gateway::ServerState modbus_server() const = 0;
};

}  // namespace loopwarden::daemon::console
