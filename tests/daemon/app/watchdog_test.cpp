// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/watchdog.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::watchdog_test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST_CASE("a thread that doesn't progress for longer than its patience is named, and only then") {
  std::uint64_t moving = 0;
  ThreadWatch watch;
  watch.add({"mover", [&] { return ++moving; }, kSecond}, 0);
  watch.add({"sleeper", [] { return std::uint64_t{7}; }, 3 * kSecond}, 0);
  CHECK(watch.stuck(kSecond).empty());
  CHECK(watch.stuck(3 * kSecond).empty());
  CHECK(watch.stuck(4 * kSecond) == std::vector<std::string>{"sleeper"});
}

TEST_CASE("a thread that moves again is healthy again") {
  std::uint64_t ticks = 1;
  ThreadWatch watch;
  watch.add({"bus", [&] { return ticks; }, kSecond}, 0);
  CHECK(watch.stuck(2 * kSecond).size() == 1);
  ++ticks;
  CHECK(watch.stuck(3 * kSecond).empty());
  CHECK(watch.stuck(4 * kSecond).empty());
  CHECK(watch.stuck(5 * kSecond).size() == 1);
}

// A substitute for the service manager: a datagram socket that collects the notifications.
class NotifySocket {
 public:
  NotifySocket() : path_((folder_ / "notify").string()) {
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~NotifySocket() {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    close(fd_);
  }
  // Returns all messages since the last call.
  std::string take() const {
    std::string all;
    std::array<char, 1024> buffer{};
    for (ssize_t n = recv(fd_, buffer.data(), buffer.size(), 0); n > 0;
         n = recv(fd_, buffer.data(), buffer.size(), 0)) {
      all.append(buffer.data(), static_cast<std::size_t>(n));
      all += '\n';
    }
    return all;
  }

 private:
  tests::TemporaryFolder folder_;
  std::string path_;
  int fd_ = -1;
};

TEST_CASE("the service manager receives ready, state, and stopping; the same state only once") {
  const NotifySocket socket;
  ServiceManager manager;
  manager.ready();
  manager.status("1 loop");
  manager.status("1 loop");
  manager.reloading();
  manager.stopping();
  const std::string said = socket.take();
  CHECK(said.find("READY=1\n") != std::string::npos);
  CHECK(said.find("STATUS=1 loop\n") != std::string::npos);
  CHECK(said.find("STATUS=1 loop", said.find("STATUS=1 loop") + 1) == std::string::npos);
  CHECK(said.find("RELOADING=1\nMONOTONIC_USEC=") != std::string::npos);
  CHECK(said.find("STOPPING=1") != std::string::npos);
}

TEST_CASE("the watchdog is fed at half its time, and only while healthy") {
  const NotifySocket socket;
  ServiceManager manager;
  manager.keep_alive(true, 10 * kSecond);
  CHECK(socket.take() == "WATCHDOG=1\n");
  manager.keep_alive(true, 11 * kSecond);
  CHECK(socket.take().empty());
  manager.keep_alive(false, 12 * kSecond);
  CHECK(socket.take().empty());
  manager.keep_alive(true, 12 * kSecond);
  CHECK(socket.take() == "WATCHDOG=1\n");
}

TEST_CASE("the watchdog is fed without a descriptor left") {
  const NotifySocket socket;
  ServiceManager manager;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{3, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  manager.keep_alive(true, 10 * kSecond);
  setrlimit(RLIMIT_NOFILE, &before);
  CHECK(socket.take() == "WATCHDOG=1\n");
}

TEST_CASE("the service manager may return, and may have no file for its socket") {
  ServiceManager nobody;  // without a service manager
  nobody.ready();
  auto socket = std::make_unique<NotifySocket>();
  ServiceManager manager;
  const std::string path = getenv("NOTIFY_SOCKET");
  socket.reset();
  manager.keep_alive(true, 10 * kSecond);
  CHECK_FALSE(std::filesystem::exists(path));
  setenv("NOTIFY_SOCKET", "@loopwarden-test-notify", 1);
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string_view name("\0loopwarden-test-notify", 23);
  name.copy(address.sun_path, name.size());
  REQUIRE(bind(fd, reinterpret_cast<const sockaddr*>(&address),
               static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())) == 0);
  ServiceManager abstract;
  abstract.ready();
  std::array<char, 64> said{};
  CHECK(recv(fd, said.data(), said.size(), 0) == 7);
  close(fd);
  unsetenv("NOTIFY_SOCKET");
}

// The sockets that a service manager passes on begin with this descriptor.
class HandedOver {
 public:
  explicit HandedOver(int type) : kept_(fcntl(kFirst, F_DUPFD_CLOEXEC, 100)) {
    const int fd = socket(AF_INET, type, 0);
    if (fd != kFirst) {
      dup2(fd, kFirst);
      close(fd);
    }
    setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
    setenv("LISTEN_FDS", "1", 1);
  }
  HandedOver(const HandedOver&) = delete;
  HandedOver& operator=(const HandedOver&) = delete;
  ~HandedOver() {
    unsetenv("LISTEN_PID");
    unsetenv("LISTEN_FDS");
    if (kept_ < 0) {
      close(kFirst);
    } else {
      dup3(kept_, kFirst, O_CLOEXEC);
      close(kept_);
    }
  }
  static constexpr int kFirst = 3;

 private:
  int kept_;
};

TEST_CASE("a listening socket from the service manager is taken, other descriptors are not") {
  CHECK(modbus_listener() == -1);
  SECTION("one that listens") {
    const HandedOver handed(SOCK_STREAM);
    REQUIRE(listen(HandedOver::kFirst, 1) == 0);
    CHECK(modbus_listener() == HandedOver::kFirst);
    CHECK((fcntl(HandedOver::kFirst, F_GETFD) & FD_CLOEXEC) != 0);
    setenv("LISTEN_PID", std::to_string(getpid() + 1).c_str(), 1);
    CHECK(modbus_listener() == -1);
    setenv("LISTEN_PID", "me", 1);
    CHECK(modbus_listener() == -1);
  }
  SECTION("one that does not") {
    const HandedOver handed(SOCK_STREAM);
    CHECK(modbus_listener() == -1);
  }
  SECTION("another kind") {
    const HandedOver handed(SOCK_DGRAM);
    CHECK(modbus_listener() == -1);
  }
}

}  // namespace
}  // namespace loopwarden::daemon::watchdog_test
