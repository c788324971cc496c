// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/console/daemon_info.hpp"
#include "daemon/console/operations.hpp"

namespace loopwarden::daemon {

struct Assembly;

// Gives the sockets and the Modbus server what they read of the daemon and what they start in it.
// Functions may be called once the assembly is complete.
class ConsoleSources final : public console::DaemonInfo, public console::Operations {
 public:
  explicit ConsoleSources(Assembly& assembly) : assembly_(assembly) {}

  protocol::DaemonStatus status() const override;
  protocol::Description description() const override;
  protocol::Links links() const override;
  std::filesystem::path configuration() const override;
  std::uint32_t config_hash() const override;
  std::string twin(std::size_t loop) const override;
  gateway::BoxReading box() const override;
  gateway::ServerState modbus_server() const override;

  std::uint64_t reload(const std::string& peer, bool dry_run, bool take_file) override;
  std::optional<protocol::ReloadState> reload_state(std::uint64_t number) const override;
  bool command_kept(std::size_t loop) const override;

 private:
  Assembly& assembly_;
};

}  // namespace loopwarden::daemon
