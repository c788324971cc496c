// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/watchdog.hpp"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
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
  const char* const path = std::getenv("NOTIFY_SOCKET");
  const std::size_t length = path == nullptr ? 0 : std::strlen(path);
  if (length < 2 || length >= sizeof address_.sun_path) return;
  address_.sun_family = AF_UNIX;
  std::copy_n(path, length, address_.sun_path);
  if (path[0] == '@') address_.sun_path[0] = '\0';  // a name that is no file
  address_size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) close(socket_);
}

bool ServiceManager::notify(std::string_view message) const {
  return sendto(socket_, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                reinterpret_cast<const sockaddr*>(&address_), address_size_) >= 0;
}

void ServiceManager::ready() { notify("READY=1"); }

void ServiceManager::reloading() {
  // MONOTONIC_USEC is what newer service managers ask for; older ones ignore it.
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const long long microseconds = now.tv_sec * 1'000'000LL + now.tv_nsec / 1000;
  notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(microseconds));
}

void ServiceManager::stopping() { notify("STOPPING=1"); }

void ServiceManager::status(const std::string& line) {
  if (line == last_status_) return;
  last_status_ = line;
  notify("STATUS=" + line);
}

void ServiceManager::keep_alive(bool healthy, std::int64_t now_ns) {
  if (interval_ns_ == 0 || !healthy || now_ns - last_ns_ < interval_ns_) return;
  // One that finds no room is sent again at the next look.
  if (notify("WATCHDOG=1")) last_ns_ = now_ns;
}

int modbus_listener() noexcept {
  const int count = sd_listen_fds(0);
  for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + count; ++fd) {
    if (sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) > 0) return fd;
  }
  return -1;
}

}  // namespace loopwarden::daemon::health
