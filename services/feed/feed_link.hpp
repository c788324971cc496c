// SPDX-License-Identifier: Apache-2.0
// A connection to feed.sock that never makes its user wait: lines are kept until the socket takes them. One that takes
// nothing until kMostWaiting bytes have gathered is given up; a new one is tried with growing pauses.
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

  // Connects where there is no connection and a try is due. True: there is a new one.
  bool connect(Clock::time_point now);
  bool connected() const noexcept { return fd_ >= 0; }
  // A line without its end. Without a connection it is dropped.
  void send(std::string_view line);
  // Writes what the socket takes now, and sees whether the daemon has closed it.
  void flush(Clock::time_point now);

  // Why there is no connection, in words; empty: there is one, or none was tried.
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
