// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/watchdog.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <utility>

namespace loopwarden::daemon {
namespace {

// The service manager's settings from the environment, as in sd_watchdog_enabled(3) and
// sd_listen_fds(3). libsystemd is not used: it would add six unused libraries, 3.4 MB, to the
// daemon's locked memory.
constexpr int kFirstListener = 3;

// Returns the number in a variable; 0 if the variable is missing or not a number.
std::int64_t number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr) return 0;
  const char* const end = text + std::strlen(text);
  std::int64_t number = 0;
  const auto [rest, error] = std::from_chars(text, end, number);
  return error == std::errc() && rest == end ? number : 0;
}

bool listens(int fd) {
  int type = 0;
  int accepts = 0;
  socklen_t size = sizeof type;
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0) return false;
  size = sizeof accepts;
  return getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &accepts, &size) == 0 && accepts == 1 &&
         type == SOCK_STREAM;
}

}  // namespace

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
  if (std::getenv("WATCHDOG_PID") == nullptr || number_in("WATCHDOG_PID") == getpid()) {
    interval_ns_ = std::max<std::int64_t>(number_in("WATCHDOG_USEC"), 0) * 1000 / 2;
  }
  const char* const path = std::getenv("NOTIFY_SOCKET");
  const std::size_t length = path == nullptr ? 0 : std::strlen(path);
  if (length < 2 || length >= sizeof address_.sun_path) return;
  address_.sun_family = AF_UNIX;
  std::copy_n(path, length, address_.sun_path);
  if (path[0] == '@') address_.sun_path[0] = '\0';  // an abstract name, not a file
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
  // Newer service managers require MONOTONIC_USEC; older ones ignore it.
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
  // If the socket is full, it is sent again in the next round.
  if (notify("WATCHDOG=1")) last_ns_ = now_ns;
}

bool has_service_manager() noexcept { return std::getenv("NOTIFY_SOCKET") != nullptr; }

int modbus_listener() noexcept {
  if (number_in("LISTEN_PID") != getpid()) return -1;
  const auto count = static_cast<int>(number_in("LISTEN_FDS"));
  int listener = -1;
  for (int fd = kFirstListener; fd < kFirstListener + count; ++fd) {
    fcntl(fd, F_SETFD, FD_CLOEXEC);
    if (listener < 0 && listens(fd)) listener = fd;
  }
  return listener;
}

}  // namespace loopwarden::daemon
