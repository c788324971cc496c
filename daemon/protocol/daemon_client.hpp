// SPDX-License-Identifier: Apache-2.0
// One of the daemon's sockets, asked by any number of threads. ask.hpp has it with structs.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/local_socket.hpp"

namespace loopwarden::protocol {

// No answer, or not the one that was wanted.
class DaemonError : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t {
    down,      // nobody answers at the socket: the request has not gone out
    refused,   // the daemon's own words
    not_known  // the request went out, and no answer came that can be read: it may have been done
  };
  DaemonError(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  Kind kind() const noexcept { return kind_; }
  bool refused() const noexcept { return kind_ == Kind::refused; }

 private:
  Kind kind_;
};

class Daemon {
 public:
  virtual ~Daemon() = default;
  // The answer without "ok". Throws DaemonError.
  virtual nlohmann::json ask(const nlohmann::json& request) = 0;
};

// Connects when it is asked, and again where the daemon has ended in between. No request goes out twice.
class DaemonClient final : public Daemon {
 public:
  DaemonClient(std::string socket, std::chrono::milliseconds patience)
      : socket_(std::move(socket)), patience_(patience) {}

  nlohmann::json ask(const nlohmann::json& request) override;
  // The answer as it was sent, refusals too.
  std::string ask_text(const std::string& request);

 private:
  std::unique_ptr<base::LocalClient> take();

  std::string socket_;
  std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<base::LocalClient>> idle_;
};

// The answer in a line of text, without "ok". Throws DaemonError.
nlohmann::json answer_in(const std::string& line);

}  // namespace loopwarden::protocol
