// SPDX-License-Identifier: Apache-2.0
// The daemon's side of its local sockets: answers one line with one line, for several sockets on one thread.
//
// Nobody can take the thread from the others. In one round each peer is answered once at most, the sockets in the order
// in which they were opened; a socket may be held to fewer answers a round and to a rate, both of all its peers
// together. What a peer sends ahead waits in its own buffer of a line's length. A peer that does not read its answer is
// not read from, and goes when it has taken nothing for kReadPatience; while a socket has more than kMostUnsent bytes
// waiting to be read, none of its peers gets another answer. An answer that has to wait for something (Later) keeps its
// peer waiting, and nobody else.
//
// What it can't do: tell two peers of one user apart; keep peers of one socket from taking all its places.
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
  std::size_t lines_a_round = 0;  // 0: one of each peer
  double lines_per_second = 0.0;  // at most, with as many at once; 0: no limit
};

class LocalServer {
 public:
  static constexpr std::size_t kLongestLine = 64UL * 1024UL;
  static constexpr std::size_t kMostUnsent = 16UL * 1024UL * 1024UL;
  static constexpr std::chrono::seconds kReadPatience{10};

  // Asked in each round, 10 ms apart, until it gives the answer.
  using Later = std::function<std::optional<std::string>()>;
  using Answer = std::variant<std::string, Later>;
  // Called with a request line and the peer's user id; returns the answer without line end. An exception ends the
  // peer's connection.
  using Handler = std::function<Answer(std::string_view line, unsigned peer_uid)>;

  LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  ~LocalServer();

  // Replaces a socket left over from a crash; refuses if another process still listens there. Throws
  // std::runtime_error.
  void listen(const LocalSocketSettings& settings, Handler handler);
  // Ends the socket's connections and removes it; does nothing if there is no such socket. Not from within a handler.
  void close(const std::string& path) noexcept;
  bool listens(const std::string& path) const noexcept;

  // One round: serves what is there, waiting at most `timeout` for it.
  void serve(std::chrono::milliseconds timeout);

 private:
  class Socket;
  std::vector<std::unique_ptr<Socket>> sockets_;
};

}  // namespace loopwarden::base
