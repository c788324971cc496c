// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/monitor.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <thread>

namespace loopwarden::daemon::supervision {
namespace {

constexpr std::chrono::milliseconds kPause{50};

}  // namespace

Monitor::Monitor(const std::vector<MonitoredLoop>& loops, AlarmRegistry& registry,
                 const Raised& raised)
    : registry_(registry), loops_(loops.size()) {
  for (std::size_t i = 0; i < loops_; ++i) registry_.supervisor(i).watch(loops[i], raised);
}

void Monitor::start() {
  thread_.start({.name = "lw-monitor"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      try {
        round();
      } catch (const std::exception& e) {
        spdlog::error("monitor: {}", e.what());
        std::this_thread::sleep_for(kPause);
      }
      if (backlog_.load(std::memory_order_relaxed) == 0) std::this_thread::sleep_for(kPause);
    }
  });
}

void Monitor::stop() {
  quit_ = true;
  thread_.join();
  for (std::size_t i = 0; i < loops_; ++i) registry_.supervisor(i).close();
}

void Monitor::round() {
  std::size_t behind = 0;
  for (std::size_t i = 0; i < loops_; ++i) {
    const LoopSupervisor::Turn turn = registry_.supervisor((first_ + i) % loops_).take_turn();
    cycles_.fetch_add(turn.cycles, std::memory_order_relaxed);
    windows_.fetch_add(turn.windows, std::memory_order_relaxed);
    if (turn.more) ++behind;
  }
  first_ = loops_ == 0 ? 0 : (first_ + 1) % loops_;
  backlog_.store(behind, std::memory_order_relaxed);
  for (std::size_t i = 0; i < registry_.loops(); ++i) registry_.of(i).pass_time();
  ticks_.fetch_add(1, std::memory_order_relaxed);
}

MonitorStatus Monitor::status() const noexcept {
  MonitorStatus status;
  status.windows = windows_.load(std::memory_order_relaxed);
  status.cycles = cycles_.load(std::memory_order_relaxed);
  status.backlog = backlog_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < loops_; ++i) status.dropped += registry_.supervisor(i).dropped();
  return status;
}

}  // namespace loopwarden::daemon::supervision
