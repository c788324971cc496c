// SPDX-License-Identifier: Apache-2.0
// Feeds the service manager's watchdog while every thread makes progress.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::daemon {

// Progress of one thread: a counter that grows while the thread is alive.
struct WatchedThread {
  std::string name;
  std::function<std::uint64_t()> ticks;
  std::int64_t patience_ns;  // longest healthy time without progress
};

class ThreadWatch {
 public:
  void add(WatchedThread thread, std::int64_t now_ns);
  // Returns the threads without progress for longer than their patience.
  std::vector<std::string> stuck(std::int64_t now_ns);

 private:
  struct State {
    WatchedThread thread;
    std::uint64_t last_ticks;
    std::int64_t moved_ns;
  };
  std::vector<State> threads_;
};

// The notify protocol of systemd (sd_notify(3)). Without systemd all calls have no effect. The
// socket is opened once. sd_notify() would open one per message, and without free descriptors the
// watchdog would kill the daemon.
class ServiceManager {
 public:
  ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;
  ~ServiceManager();
  void ready();
  void reloading();
  void stopping();
  void status(const std::string& line);
  // Sends the keep-alive when half of the watchdog's time has passed and `healthy`.
  void keep_alive(bool healthy, std::int64_t now_ns);

 private:
  bool notify(std::string_view message) const;  // returns false if it could not be sent

  int socket_ = -1;  // -1: no service manager
  sockaddr_un address_{};
  socklen_t address_size_ = 0;
  std::int64_t interval_ns_ = 0;  // 0: no watchdog requested
  std::int64_t last_ns_ = 0;
  std::string last_status_;
};

// Returns true if a service manager started this process and restarts it after a failure.
bool has_service_manager() noexcept;

// Returns the listening TCP socket that the service manager passed (loopwardend.socket); -1: none.
int modbus_listener() noexcept;

}  // namespace loopwarden::daemon
