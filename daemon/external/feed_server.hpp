// SPDX-License-Identifier: Apache-2.0
// feed.sock, on a thread of its own, `lw-feed`: takes lines of values (daemon/protocol/feed_line.hpp) from feeders and leaves
// them on the board, where watched loops find them. No value of a loop that is controlled here can come this way.
//
// Who a peer is decides whose values he writes: by the user id of his process he is one feeder of loopwardend.yaml, or he
// is nobody and let go. A feeder has one connection; a new one ends the old. What can't be read of a line is counted,
// logged once a minute, and the connection stays; a line too long is passed over to its end.
//
// A flood delays nobody: in one round each feeder is read once, kMostBytesARound; what is more than the rate of one
// is left in its socket, where it finds no more room.
//
// What it can't do: know whether what a feeder says is true.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/thread.hpp"
#include "hal/feed/feed_board.hpp"

namespace loopwarden::daemon::external {

class FeedServer {
 public:
  static constexpr std::size_t kMostBytesARound = 64UL * 1024UL;
  // Thousands of loops' values at 1 s, and a small part of a core to read.
  static constexpr double kBytesPerSecond = 1e6;

  struct Right {
    std::string feeder;
    unsigned uid = 0;
  };

  // Listens from now on. `board` outlives this, and has all feeders. `bytes_per_second`: of one feeder, and as many at
  // once. Throws std::runtime_error.
  FeedServer(std::string path, std::vector<Right> rights, std::optional<unsigned> group,
             hal::feed::FeedBoard& board, double bytes_per_second = kBytesPerSecond);
  FeedServer(const FeedServer&) = delete;
  FeedServer& operator=(const FeedServer&) = delete;
  ~FeedServer();

  void start();
  void stop() noexcept;
  // One round: serves what is there, waiting at most `timeout` for it; public for tests.
  void serve(std::chrono::milliseconds timeout);

  // Any thread.
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }
  // Connections of users who are no feeders.
  std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  using Steady = std::chrono::steady_clock;
  struct Peer {
    int fd = -1;
    const std::string* name = nullptr;
    hal::feed::Feeder* feeder = nullptr;
    std::string received{};
    bool passes_over = false;  // what is left of a line that was too long
    std::string to_send{};
    double allowance = 0.0;  // bytes
    Steady::time_point refilled{};
  };
  struct BadLines {
    std::uint64_t since_logged = 0;
    Steady::time_point log_again{};
  };

  void accept_peer();
  void let_go(Peer& peer) noexcept;
  bool move(Peer& peer, short ready);
  bool receive(Peer& peer);
  void take_lines(Peer& peer);
  void take(Peer& peer, std::string_view line);
  void bad_line(Peer& peer, const std::string& why);
  void drop_closed();

  std::string path_;
  std::vector<Right> rights_;
  hal::feed::FeedBoard& board_;
  double bytes_per_second_;
  int listener_;
  std::vector<Peer> peers_;
  std::map<std::string, BadLines> bad_;  // by feeder
  Steady::time_point refusal_log_again_{};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::external
