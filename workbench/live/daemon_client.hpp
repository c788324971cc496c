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

// Returns the option that repeats `socket` in a printed command, with a leading blank. Returns an
// empty text for the default socket.
std::string socket_option(const std::string& socket);

// The daemon answered with a refusal: a usage error if the tag is unknown, a data error if the
// request is not possible now.
class DaemonRefused : public protocol::DaemonError {
 public:
  DaemonRefused(ExitCode code, const std::string& what, Kind kind = Kind::refused)
      : DaemonError(kind, what), code_(code) {}
  ExitCode exit_code() const noexcept { return code_; }

 private:
  ExitCode code_;
};

class OrderNotTaken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A connection to the daemon on this machine. A command ends if the daemon ends.
// daemon/protocol/ask.hpp offers the same requests as structs.
class DaemonClient final : public protocol::Daemon {
 public:
  static constexpr const char* kDefaultSocket = "/run/loopwardend/control.sock";

  // Throws std::runtime_error if no daemon answers on the socket. Without permission, the text
  // names the group that has it and the command that adds this user.
  explicit DaemonClient(const std::string& socket_path);

  // Throws DaemonRefused with the daemon's text, or std::runtime_error without an answer.
  nlohmann::json ask(const nlohmann::json& request) override;
  // Sends a command and returns after the loop's cycle has taken it. Waits up to `for_disk` for the
  // entry in the journal on the disk; returns false if the entry is not there yet. Throws
  // DaemonRefused if the command has no effect, and OrderNotTaken if no cycle took it.
  bool set(const protocol::SetRequest& request,
           std::chrono::milliseconds for_disk = std::chrono::milliseconds(0));

 private:
  base::LocalClient client_;
};

}  // namespace loopwarden::workbench
