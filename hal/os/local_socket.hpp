// SPDX-License-Identifier: Apache-2.0
// Lines of text over a Unix domain socket: how the workbench talks to the daemon on the same box.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::hal::os {

// One connection from the workbench. Throws std::runtime_error when the daemon can't be reached or
// does not answer.
class LocalClient {
 public:
  explicit LocalClient(const std::string& path);
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;
  ~LocalClient();

  // Sends a line and waits for the line that answers it.
  std::string request(std::string_view line, std::chrono::milliseconds timeout);

 private:
  int fd_;
  std::string received_;
};

// The daemon's side: answers one line with one line. All on the thread that calls serve().
class LocalServer {
 public:
  // Called with a request line and the peer's user id; returns the answer without line end.
  using Handler = std::function<std::string(std::string_view line, unsigned peer_uid)>;

  // Replaces a socket left over from a crash; refuses if another process still listens there.
  // Owner and group may connect. Throws std::runtime_error.
  LocalServer(std::string path, Handler handler);
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  ~LocalServer();

  // Serves what is there, waiting at most `timeout` for it.
  void serve(std::chrono::milliseconds timeout);

 private:
  struct Peer {
    int fd = -1;
    unsigned uid = 0;
    std::string received;
    std::string to_send;
  };
  void accept_peer();
  bool serve_peer(Peer& peer, short ready) noexcept;
  bool receive(Peer& peer);
  static bool send_pending(Peer& peer);
  void answer_lines(Peer& peer);

  static constexpr std::size_t kMostPeers = 16;
  static constexpr std::size_t kLongestLine = 64UL * 1024UL;

  std::string path_;
  Handler handler_;
  int fd_ = -1;
  std::vector<Peer> peers_;
  // Out of descriptors: who waits stays in the queue, and this thread does not spin on it.
  std::chrono::steady_clock::time_point accept_again_{};
};

}  // namespace loopwarden::hal::os
