// SPDX-License-Identifier: Apache-2.0
// The loops that other controllers run: their sources, the thread that samples them, and the socket
// of the feeders.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/clock.hpp"
#include "base/spsc_ring.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/backend_factory.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/external/feed_server.hpp"
#include "daemon/external/sampler.hpp"
#include "hal/feed/feed_table.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

class WatchedLoops {
 public:
  explicit WatchedLoops(base::Clock& clock) : sampler_(clock) {}
  WatchedLoops(const WatchedLoops&) = delete;
  WatchedLoops& operator=(const WatchedLoops&) = delete;

  // Appends the watched loops after the controlled ones. `loops` must have the capacity, because
  // its elements may not move. `backends` must outlive the loops. Throws std::runtime_error.
  void make(const config::Configuration& configuration, BackendFactory& backends,
            std::vector<LoopRuntime>& loops);
  void start();
  void stop() noexcept;

  // For the main thread.
  bool next_event(rt::Event& event) noexcept { return events_.try_pop(event); }

  const hal::feed::FeedTable& board() const noexcept { return board_; }
  // Null if no loop is watched.
  const external::Sampler* sampler() const noexcept {
    return sampler_.empty() ? nullptr : &sampler_;
  }
  const external::FeedServer* feed() const noexcept { return feed_.get(); }
  // Returns why feed.sock is not open; empty: it is, or no feeder is configured. From any thread.
  std::string problem() const { return feed_ ? feed_->problem() : std::string(); }
  // From any thread.
  std::vector<protocol::FeederStatus> feeders(std::int64_t now_ns) const;

 private:
  hal::feed::FeedTable board_;
  base::SpscRing<rt::Event> events_{4096};
  external::Sampler sampler_;
  std::unique_ptr<external::FeedServer> feed_;
};

}  // namespace loopwarden::daemon
