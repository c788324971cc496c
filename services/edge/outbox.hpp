// SPDX-License-Identifier: Apache-2.0
// Store and forward: what could not be sent waits in the store; what was sent a short while before the connection or
// the host was lost goes there too, since QoS 0 confirms nothing; all of it is sent again later, oldest first.
//
// Where the disk refuses, reports wait in memory, a bounded number of them; the oldest goes, counted.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "services/edge/store.hpp"

namespace loopwarden::edge {

class Outbox {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostInMemory = 20'000;  // reports, of each kind

  // `window`: what was sent this short before a loss may not have arrived.
  Outbox(Store& store, std::chrono::milliseconds window) : store_(store), window_(window) {}

  // A report went out now.
  void sent(Report report, Clock::time_point now);
  // A report could not go out.
  void keep(Report report);
  // Broker or host are gone: whatever may not have arrived is to be sent again.
  void lost(Clock::time_point now);

  // Once a second or so: puts on the disk what waits for it, forgets what has surely arrived.
  void tidy(Clock::time_point now);
  // Sends up to `most` stored reports, oldest first; `send` says whether it could.
  void replay(std::size_t most, Clock::time_point now,
              const std::function<bool(const Report&)>& send);

  // A stored report that nobody could read any more was not sent.
  void drop_one() noexcept { ++dropped_; }

  std::uint64_t waiting() const noexcept;  // reports, on the disk and for it
  std::uint64_t dropped() const noexcept { return store_.dropped() + dropped_; }

 private:
  using Sent = std::pair<Clock::time_point, Report>;
  void flush();

  Store& store_;
  std::chrono::milliseconds window_;
  std::deque<Sent> sent_;
  std::deque<Report> for_disk_;
  bool disk_refuses_ = false;
  std::uint64_t dropped_ = 0;  // in memory
  // Rows of the store that went out again: until they have surely arrived they stay.
  std::int64_t replayed_up_to_ = 0;
  std::deque<std::pair<Clock::time_point, std::int64_t>> replayed_;
};

}  // namespace loopwarden::edge
