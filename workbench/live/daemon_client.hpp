// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "base/exit_code.hpp"
#include "base/local_socket.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::workbench {

// The daemon answers and does not do it: usage where a tag is unknown, data where it can't be done now.
class DaemonRefused : public protocol::DaemonError {
 public:
  DaemonRefused(ExitCode code, const std::string& what)
      : DaemonError(Kind::refused, what), code_(code) {}
  ExitCode exit_code() const noexcept { return code_; }

 private:
  ExitCode code_;
};

class OrderNotTaken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The daemon on this box, over one connection: a command ends where the daemon does. daemon/protocol/ask.hpp has it with structs.
class DaemonClient final : public protocol::Daemon {
 public:
  static constexpr const char* kDefaultSocket = "/run/loopwardend/control.sock";

  // Throws std::runtime_error if nobody answers there.
  explicit DaemonClient(const std::string& socket_path) : client_(socket_path) {}

  // Throws DaemonRefused with the daemon's own words, std::runtime_error if there is no answer.
  nlohmann::json ask(const nlohmann::json& request) override;
  // Comes back when the loop's cycle has taken the order and it is in the journal on the disk, for which it waits no
  // longer than `for_disk`; false: it is not there yet. Throws DaemonRefused where the order can't act, OrderNotTaken
  // where no cycle took it.
  bool set(const protocol::SetRequest& request,
           std::chrono::milliseconds for_disk = std::chrono::milliseconds(0));

 private:
  base::LocalClient client_;
};

}  // namespace loopwarden::workbench
