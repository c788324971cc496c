// SPDX-License-Identifier: Apache-2.0
// A thread-safe client of one socket of the daemon. ask.hpp adds requests and answers as structs.
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

// The daemon gave no answer, or not the expected answer.
class DaemonError : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t {
    down,     // the socket refused the connection: the request was not sent
    refused,  // the daemon refused the request, with its own text
    not_yet,  // it refused the request now; the same request may succeed some cycles later
    // the request was sent, but the answer is missing or unreadable: the request may have been
    // executed
    not_known
  };
  DaemonError(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  Kind kind() const noexcept { return kind_; }
  bool refused() const noexcept { return kind_ == Kind::refused || kind_ == Kind::not_yet; }

 private:
  Kind kind_;
};

// Returns why this user can't connect to a socket of the daemon, with the group that can and the
// command that adds the user. Returns an empty text if the user has the permission, or if the
// socket does not exist.
std::string no_permission(const std::string& socket);

class Daemon {
 public:
  virtual ~Daemon() = default;
  // Returns the answer without "ok". Throws DaemonError.
  virtual nlohmann::json ask(const nlohmann::json& request) = 0;
};

// Connects at the first request, and again if the daemon has ended in between. A request is sent at
// most once.
class DaemonClient final : public Daemon {
 public:
  DaemonClient(std::string socket, std::chrono::milliseconds patience)
      : socket_(std::move(socket)), patience_(patience) {}

  nlohmann::json ask(const nlohmann::json& request) override;
  // Returns the answer as received, including refusals.
  std::string ask_text(const std::string& request);

 private:
  std::unique_ptr<base::LocalClient> take();

  std::string socket_;
  std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<base::LocalClient>> idle_;
};

// Parses an answer from a line of text and removes "ok". Throws DaemonError.
nlohmann::json answer_in(const std::string& line);

}  // namespace loopwarden::protocol
