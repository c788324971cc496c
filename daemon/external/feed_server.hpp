// SPDX-License-Identifier: Apache-2.0
// The server of feed.sock, on the thread `lw-feed`. It takes lines of values
// (daemon/protocol/feed_line.hpp) from feeders and puts them into the table for the watched loops.
// Loops controlled here get no values this way.
//
// The user id of a peer's process identifies it as one feeder of loopwardend.yaml. Other peers are
// disconnected. Each feeder has one connection; a second one closes the first. Unreadable parts of
// a line are counted and logged once a minute, and the connection stays. A line that is too long is
// skipped.
//
// A flood does not delay other feeders. Each feeder is read once per round, at most
// kMostBytesARound. Data above a feeder's rate stay in its socket until that is full.
//
// Limit: it can't check whether a feeder's values are true.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/repeated_attempt.hpp"
#include "base/thread.hpp"
#include "hal/feed/feed_table.hpp"

namespace loopwarden::daemon::external {

class FeedServer {
 public:
  static constexpr std::size_t kMostBytesARound = 64UL * 1024UL;
  // Enough for the values of thousands of loops at 1 s. Reading them takes a small part of a core.
  static constexpr double kBytesPerSecond = 1e6;

  struct Right {
    std::string feeder;
    unsigned uid = 0;
  };

  // Starts listening. A socket that can't be opened is tried again until it can. The table must
  // outlive this and contain all feeders. `bytes_per_second`: rate and burst per feeder.
  FeedServer(std::string path, std::vector<Right> rights, std::optional<unsigned> group,
             hal::feed::FeedTable& board, double bytes_per_second = kBytesPerSecond);
  FeedServer(const FeedServer&) = delete;
  FeedServer& operator=(const FeedServer&) = delete;
  ~FeedServer();

  void start();
  void stop() noexcept;
  // Serves the available data once. Waits at most `timeout` for data. Public for tests.
  void serve(std::chrono::milliseconds timeout);

  // From any thread.
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }
  // Returns why the socket is not open; empty: it is.
  std::string problem() const { return opening_.problem(); }
  // Connections of users who are not feeders.
  std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  using Steady = std::chrono::steady_clock;
  struct Peer {
    int fd = -1;
    unsigned uid = 0;
    const std::string* name = nullptr;  // null: several feeders have this user, and none is named
    hal::feed::Feeder* feeder = nullptr;
    std::string received{};
    bool passes_over = false;  // skips the remainder of a line that was too long
    std::string to_send{};
    double allowance = 0.0;  // bytes
    Steady::time_point refilled{};
  };
  struct BadLines {
    std::uint64_t since_logged = 0;
    Steady::time_point log_again{};
  };

  void open();
  void accept_peer();
  // Connects the peer to its feeder. An earlier connection of that feeder ends.
  void assign(Peer& peer, const Right& right);
  // Finds the feeder that the peer's first line names. Returns false if the connection must end.
  bool identify(Peer& peer, std::string_view line);
  void let_go(Peer& peer) noexcept;
  bool move(Peer& peer, short ready);
  bool receive(Peer& peer);
  bool take_lines(Peer& peer);  // false: the connection must end
  void take(Peer& peer, std::string_view line);
  void bad_line(Peer& peer, const std::string& why);
  void drop_closed();

  std::string path_;
  std::vector<Right> rights_;
  std::optional<unsigned> group_;
  hal::feed::FeedTable& board_;
  double bytes_per_second_;
  int listener_ = -1;  // -1: not open yet
  base::RepeatedAttempt opening_{"feed.sock"};
  std::vector<Peer> peers_;
  std::map<std::string, BadLines> bad_;  // by feeder
  Steady::time_point refusal_log_again_{};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::external
