// SPDX-License-Identifier: Apache-2.0
// A connection to feed.sock that never blocks its caller: lines are kept until the socket takes
// them. It is given up if kMostWaiting bytes have gathered. New attempts follow with growing
// pauses.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

#include "base/back_off.hpp"

namespace loopwarden::feed {

class FeedLink {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostWaiting = 8UL * 1024UL * 1024UL;

  explicit FeedLink(std::string path) : path_(std::move(path)) {}
  FeedLink(const FeedLink&) = delete;
  FeedLink& operator=(const FeedLink&) = delete;
  ~FeedLink() { close(); }

  // Connects if there is no connection and a try is due. Returns true for a new connection.
  bool connect(Clock::time_point now);
  bool connected() const noexcept { return fd_ >= 0; }
  // Sends a line (`line` without its end). Without a connection the line is dropped.
  void send(std::string_view line);
  // Writes the bytes that the socket takes now, and detects whether the daemon has closed it.
  void flush(Clock::time_point now);

  // Returns why there is no connection; empty if there is one, or before the first try.
  const std::string& why() const noexcept { return why_; }

 private:
  void lost(Clock::time_point now, std::string why);
  void close() noexcept;

  std::string path_;
  int fd_ = -1;
  std::string waiting_;
  std::string why_;
  base::BackOff back_off_{.first = std::chrono::milliseconds(200),
                          .longest = std::chrono::milliseconds(5000)};
  std::int64_t failures_ = 0;
  Clock::time_point since_{};
  Clock::time_point next_try_{};
  std::minstd_rand random_{std::random_device{}()};
};

}  // namespace loopwarden::feed
