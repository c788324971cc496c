// SPDX-License-Identifier: Apache-2.0
// Stores and forwards. Reports that can't be sent wait in the store. Reports sent shortly before
// the connection or the host was lost are stored as well, because QoS 0 has no confirmation. All of
// them are sent again later, oldest first.
//
// If the disk refuses, a bounded number of reports waits in memory. Beyond it the oldest are
// dropped and counted.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

#include "services/edge/store.hpp"

namespace loopwarden::edge {

class Outbox {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostInMemory = 20'000;  // reports, of each kind

  // `window`: reports sent within this time before a loss may not have arrived.
  Outbox(Store& store, std::chrono::milliseconds window) : store_(store), window_(window) {}

  // Records a report that was sent now.
  void sent(Report report, Clock::time_point now);
  // Keeps a report that could not be sent.
  void keep(Report report);
  // Broker or host are gone: stores all reports that may not have arrived.
  void lost(Clock::time_point now);

  // Writes waiting reports to the disk and removes those that have surely arrived. Call it about
  // once a second.
  void tidy(Clock::time_point now);
  // Sends up to `most` stored reports, oldest first. `send` returns whether it succeeded.
  void replay(std::size_t most, Clock::time_point now,
              const std::function<bool(const Report&)>& send);

  // Counts a stored report that was not sent because no host could decode it any more.
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
  // Rows of the store that were sent again. They stay until they have surely arrived.
  std::int64_t replayed_up_to_ = 0;
  std::deque<std::pair<Clock::time_point, std::int64_t>> replayed_;
};

}  // namespace loopwarden::edge
