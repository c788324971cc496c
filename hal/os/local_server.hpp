// SPDX-License-Identifier: Apache-2.0
// The daemon's side of its local sockets: answers one line with one line, for several sockets on one thread.
//
// Nobody can take the thread from the others. In one round each peer is answered once at most, the sockets in the order
// in which they were opened; a socket may be held to fewer answers a round and to a rate, both of all its peers
// together. What a peer sends ahead waits in its own buffer of a line's length. A peer that does not read its answer is
// not read from, and goes when it has taken nothing for kReadPatience; while a socket has more than kMostUnsent bytes
// waiting to be read, none of its peers gets another answer.
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
#include <vector>

namespace loopwarden::hal::os {

struct LocalSocketSettings {
  std::string path;
  // Who may connect besides the owner. Nothing, or one of which the process is no member: its own group.
  std::optional<unsigned> group{};
  std::size_t most_peers = 16;
  std::size_t lines_a_round = 0;  // 0: one of each peer
  double lines_per_second = 0.0;  // at most, with as many at once; 0: no limit
};

// The number of a group by its name; nothing: there is none. May ask a directory service: not for a thread in a hurry.
std::optional<unsigned> group_id(const std::string& name);

class LocalServer {
 public:
  static constexpr std::size_t kLongestLine = 64UL * 1024UL;
  static constexpr std::size_t kMostUnsent = 16UL * 1024UL * 1024UL;
  static constexpr std::chrono::seconds kReadPatience{10};

  // Called with a request line and the peer's user id; returns the answer without line end. An exception ends the
  // peer's connection.
  using Handler = std::function<std::string(std::string_view line, unsigned peer_uid)>;

  LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  ~LocalServer();

  // Replaces a socket left over from a crash; refuses if another process still listens there. Throws
  // std::runtime_error.
  void listen(const LocalSocketSettings& settings, Handler handler);
  // Ends its connections and removes it; nothing where there is none. Not from within a handler.
  void close(const std::string& path) noexcept;
  bool listens(const std::string& path) const noexcept;

  // One round: serves what is there, waiting at most `timeout` for it.
  void serve(std::chrono::milliseconds timeout);

 private:
  class Socket;
  std::vector<std::unique_ptr<Socket>> sockets_;
};

}  // namespace loopwarden::hal::os
