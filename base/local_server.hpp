// SPDX-License-Identifier: Apache-2.0
// The daemon's side of its local sockets: answers one line with one line, for several sockets on
// one thread.
//
// No peer can block the others:
// - In one round each peer gets at most one answer. The sockets take turns in the order in which
//   they were opened.
// - A socket may be limited to fewer answers per round and to a rate. Both limits apply to all its
//   peers together.
// - Lines that a peer sends ahead wait in its own buffer, which has the length of one line.
// - A peer that does not read its answer is not read from. It is disconnected if it has taken no
//   byte for kReadPatience.
// - While a socket has more than kMostUnsent bytes waiting to be read, its peers get no further
//   answer.
// - If an answer has to wait (Later), only its own peer waits.
//
// Limits: it can't distinguish two peers of one user, and peers of one socket can take all its
// places.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace loopwarden::base {

struct LocalSocketSettings {
  std::string path;
  std::optional<unsigned> group{};  // as of local_listener()
  std::size_t most_peers = 16;
  std::size_t lines_a_round = 0;  // 0: one per peer
  double lines_per_second = 0.0;  // at most, and as many in a burst; 0: no limit
};

class LocalServer {
 public:
  static constexpr std::size_t kLongestLine = 64UL * 1024UL;
  static constexpr std::size_t kMostUnsent = 16UL * 1024UL * 1024UL;
  static constexpr std::chrono::seconds kReadPatience{10};

  // Called in each round, 10 ms apart, until it returns the answer.
  using Later = std::function<std::optional<std::string>()>;
  using Answer = std::variant<std::string, Later>;
  // Called with a request line and the peer's user id. Returns the answer without line end. An
  // exception ends the peer's connection.
  using Handler = std::function<Answer(std::string_view line, unsigned peer_uid)>;

  LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  ~LocalServer();

  // Opens the socket as local_listener(). Throws std::runtime_error.
  void listen(const LocalSocketSettings& settings, Handler handler);
  // Ends the socket's connections and removes it. Has no effect if there is no such socket. Not
  // from within a handler.
  void close(const std::string& path) noexcept;
  bool listens(const std::string& path) const noexcept;

  // Runs one round: serves all ready peers and waits at most `timeout` for the first of them.
  void serve(std::chrono::milliseconds timeout);

 private:
  class Socket;
  std::vector<std::unique_ptr<Socket>> sockets_;
};

}  // namespace loopwarden::base
