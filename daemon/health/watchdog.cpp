// SPDX-License-Identifier: Apache-2.0
#include "daemon/health/watchdog.hpp"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>

#include <ctime>
#include <utility>

namespace loopwarden::daemon::health {

void ThreadWatch::add(WatchedThread thread, std::int64_t now_ns) {
  const std::uint64_t ticks = thread.ticks();
  threads_.push_back({std::move(thread), ticks, now_ns});
}

std::vector<std::string> ThreadWatch::stuck(std::int64_t now_ns) {
  std::vector<std::string> names;
  for (State& state : threads_) {
    const std::uint64_t ticks = state.thread.ticks();
    if (ticks != state.last_ticks) {
      state.last_ticks = ticks;
      state.moved_ns = now_ns;
    } else if (now_ns - state.moved_ns > state.thread.patience_ns) {
      names.push_back(state.thread.name);
    }
  }
  return names;
}

ServiceManager::ServiceManager() {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    interval_ns_ = static_cast<std::int64_t>(watchdog_us) * 1000 / 2;
  }
}

void ServiceManager::ready() { sd_notify(0, "READY=1"); }

void ServiceManager::reloading() {
  // MONOTONIC_USEC is what newer service managers ask for; older ones ignore it.
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const long long microseconds = now.tv_sec * 1'000'000LL + now.tv_nsec / 1000;
  sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%lld", microseconds);
}

void ServiceManager::stopping() { sd_notify(0, "STOPPING=1"); }

void ServiceManager::status(const std::string& line) {
  if (line == last_status_) return;
  last_status_ = line;
  sd_notify(0, ("STATUS=" + line).c_str());
}

void ServiceManager::keep_alive(bool healthy, std::int64_t now_ns) {
  if (interval_ns_ == 0 || !healthy || now_ns - last_ns_ < interval_ns_) return;
  last_ns_ = now_ns;
  sd_notify(0, "WATCHDOG=1");
}

int modbus_listener() noexcept {
  const int count = sd_listen_fds(0);
  for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + count; ++fd) {
    if (sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) > 0) return fd;
  }
  return -1;
}

}  // namespace loopwarden::daemon::health
