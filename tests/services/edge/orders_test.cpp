// SPDX-License-Identifier: Apache-2.0
// Reports about commands that the daemon accepts, and about commands whose effect is unknown.
#include "services/edge/orders.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include <array>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "base/local_address.hpp"
#include "tests/support/temporary_folder.hpp"

namespace orders_test {

using namespace loopwarden;
using edge::Order;
using edge::Orders;

// Listens at edge.sock. The test serves each connection.
class EdgeSocket {
 public:
  explicit EdgeSocket(const std::filesystem::path& folder)
      : path_((folder / "edge.sock").string()),
        fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_un own = base::local_address(path_);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0);
    REQUIRE(::listen(fd_, 4) == 0);
  }
  EdgeSocket(const EdgeSocket&) = delete;
  EdgeSocket& operator=(const EdgeSocket&) = delete;
  ~EdgeSocket() {
    ::close(fd_);
    std::filesystem::remove(path_);
  }
  // Accepts a connection, reads a line and replies with `answer` (empty: no reply). Returns the
  // connection.
  int take(const std::string& answer) const {
    const int peer = ::accept(fd_, nullptr, nullptr);
    std::string line;
    for (std::array<char, 512> bytes{}; line.find('\n') == std::string::npos;) {
      const ssize_t count = ::recv(peer, bytes.data(), bytes.size(), 0);
      if (count <= 0) return peer;
      line.append(bytes.data(), static_cast<std::size_t>(count));
    }
    if (!answer.empty()) ::send(peer, (answer + "\n").data(), answer.size() + 1, MSG_NOSIGNAL);
    return peer;
  }

 private:
  std::string path_;
  int fd_;
};

const Order kSetPoint{"sp 5", protocol::SetRequest{.set_point = 5.0}};
const Order kAcknowledge{"acknowledge_stiction", protocol::AlarmRequest{}};

std::string told(Orders& orders) {
  const std::vector<Orders::Outcome> all = orders.outcomes();
  return all.size() == 1 ? all.front().text : std::to_string(all.size()) + " outcomes";
}

TEST_CASE("an order that was not delivered is refused", "[edge]") {
  const tests::TemporaryFolder folder;
  Orders orders(folder.path(), true);
  orders.give("d", "FIC-101", kSetPoint);
  CHECK_THAT(told(orders), Catch::StartsWith("sp 5: refused: no socket for commands"));
}

TEST_CASE("the outcome of an order without an answer is unknown", "[edge]") {
  const tests::TemporaryFolder folder;
  const EdgeSocket socket(folder.path());
  Orders orders(folder.path(), true);
  int peer = -1;
  SECTION("the daemon closes the connection") {
    std::thread daemon([&] { ::close(socket.take("")); });
    orders.give("d", "FIC-101", kSetPoint);
    daemon.join();
    CHECK(told(orders) == "sp 5: not known: the daemon closed the connection");
  }
  SECTION("the daemon does not answer") {
    std::thread daemon([&] { peer = socket.take(""); });
    orders.give("d", "FIC-101", kSetPoint);
    daemon.join();
    CHECK(told(orders) == "sp 5: not known: the daemon did not answer in time");
    ::close(peer);
  }
  SECTION("an invalid answer") {
    std::thread daemon([&] { peer = socket.take("rubbish"); });
    orders.give("d", "FIC-101", kSetPoint);
    daemon.join();
    CHECK_THAT(told(orders), Catch::StartsWith("sp 5: not known: "));
    ::close(peer);
  }
  SECTION("an answer without its fields") {
    std::thread daemon([&] { peer = socket.take(R"({"ok": true, "order": "x"})"); });
    orders.give("d", "FIC-101", kSetPoint);
    daemon.join();
    CHECK_THAT(told(orders), Catch::StartsWith("sp 5: not known: "));
    ::close(peer);
  }
}

TEST_CASE("an order that is done and not in the journal yet is reported as done", "[edge]") {
  const tests::TemporaryFolder folder;
  const EdgeSocket socket(folder.path());
  Orders orders(folder.path(), true);
  int peer = -1;
  std::thread daemon([&] { peer = socket.take(R"({"ok": true, "on_disk": false})"); });
  orders.give("d", "FIC-101", kAcknowledge);
  daemon.join();
  CHECK(told(orders) == "acknowledge_stiction: done, not yet in the journal");
  ::close(peer);
}

TEST_CASE("acknowledge_all is reported as far as its outcome is known", "[edge]") {
  const tests::TemporaryFolder folder;
  Orders orders(folder.path(), true);
  const std::vector<Orders::Loop> loops{{"d", "FIC-101", true}};
  SECTION("it was not delivered") {
    orders.acknowledge_all(loops);
    CHECK_THAT(told(orders), Catch::StartsWith("acknowledge_all: refused: no socket for commands"));
  }
  const EdgeSocket socket(folder.path());
  const auto answered = [&](const std::string& answer) {
    std::thread daemon([&] { ::close(socket.take(answer)); });
    orders.acknowledge_all(loops);
    daemon.join();
    return told(orders);
  };
  SECTION("no answer") {
    CHECK_THAT(answered(""), Catch::StartsWith("acknowledge_all: not known: "));
  }
  SECTION("an answer of another kind") {
    CHECK_THAT(answered(R"({"ok": true})"), Catch::StartsWith("acknowledge_all: not known: "));
  }
  SECTION("done, and not in the journal yet") {
    CHECK(answered(R"({"ok": true, "on_disk": false, "acknowledged": [)"
                   R"({"loop": "FIC-101", "alarm": "stiction"}]})") ==
          "acknowledge_stiction: done, not yet in the journal");
  }
}

TEST_CASE("the first order after a restart of the daemon reaches the new one", "[edge]") {
  const tests::TemporaryFolder folder;
  Orders orders(folder.path(), true);
  for (int run = 0; run < 2; ++run) {
    const EdgeSocket socket(folder.path());
    std::thread daemon([&] { ::close(socket.take(R"({"ok": true, "on_disk": true})")); });
    orders.give("d", "FIC-101", kAcknowledge);
    daemon.join();
    CHECK(told(orders) == "acknowledge_stiction: done");
  }
}

}  // namespace orders_test
