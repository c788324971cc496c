// SPDX-License-Identifier: Apache-2.0
#include "base/local_socket.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "base/local_address.hpp"
#include "tests/support/temporary_folder.hpp"

namespace local_socket_test {

using namespace loopwarden::base;
using loopwarden::tests::TemporaryFolder;
using std::chrono::milliseconds;

namespace {

constexpr milliseconds kShort{30};
constexpr milliseconds kLong{20'000};

// Listens, and accepts and reads as the test requests.
class Listener {
 public:
  explicit Listener(const std::string& path)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_un address = local_address(path);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(::listen(fd_, 1) == 0);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() {
    if (peer_ >= 0) ::close(peer_);
    ::close(fd_);
  }

  void take() {
    peer_ = ::accept(fd_, nullptr, nullptr);
    REQUIRE(peer_ >= 0);
  }
  std::string heard(std::size_t bytes) const {
    std::string text(bytes, ' ');
    REQUIRE(::recv(peer_, text.data(), bytes, MSG_WAITALL) == static_cast<ssize_t>(bytes));
    return text;
  }
  void say(const std::string& text) const {
    REQUIRE(::send(peer_, text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }

 private:
  int fd_;
  int peer_ = -1;
};

}  // namespace

TEST_CASE("a stopped daemon with a full queue of connections blocks no client") {
  const TemporaryFolder folder;
  const std::string path = (folder / "s").string();
  const Listener listener(path);
  int refused = 0;
  for (int i = 0; i < 5; ++i) {
    try {
      const LocalClient client(path, kShort);
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  // Each client closes its connection, but the queue keeps it. The first clients fill the queue.
  CHECK(refused >= 3);
}

TEST_CASE("a client that waits for a place in a full queue gets the next free one") {
  const TemporaryFolder folder;
  const std::string path = (folder / "s").string();
  Listener listener(path);
  const LocalClient first(path, kLong);
  const LocalClient second(path, kLong);
  CHECK_THROWS(LocalClient(path, kShort));
  std::thread later([&] { listener.take(); });
  CHECK_NOTHROW(LocalClient(path, kLong));
  later.join();
}

TEST_CASE("a daemon that doesn't read blocks no client, even with a long line") {
  const TemporaryFolder folder;
  const std::string path = (folder / "s").string();
  const Listener listener(path);
  LocalClient client(path, kLong);
  CHECK_THROWS_WITH(client.request(std::string(8'000'000, 'x'), kShort),
                    Catch::Contains("did not answer in time"));
  // Half of a line was sent, so no other line can follow.
  CHECK_THROWS_WITH(client.request("x", kShort), Catch::Contains("closed the connection"));
}

TEST_CASE("a late answer is not mistaken for the answer to the next line") {
  const TemporaryFolder folder;
  const std::string path = (folder / "s").string();
  Listener listener(path);
  LocalClient client(path, kLong);
  listener.take();
  CHECK_THROWS_WITH(client.request("one", kShort), Catch::Contains("did not answer in time"));
  std::thread daemon([&] {
    CHECK(listener.heard(8) == "one\ntwo\n");
    listener.say("first\nsec");
    listener.say("ond\n");
  });
  CHECK(client.request("two", kLong) == "second");
  daemon.join();
}

TEST_CASE("the wait for a slow answer ends at the time-out") {
  const TemporaryFolder folder;
  const std::string path = (folder / "s").string();
  Listener listener(path);
  LocalClient client(path, kLong);
  listener.take();
  std::atomic<bool> quit{false};
  std::thread daemon([&] {
    while (!quit) {
      listener.say(".");
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  CHECK_THROWS_WITH(client.request("x", kShort), Catch::Contains("did not answer in time"));
  quit = true;
  daemon.join();
}

}  // namespace local_socket_test
