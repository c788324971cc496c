// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/gateway.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "base/peer_list.hpp"
#include "tests/daemon/gateway/fake_loops.hpp"
#include "tests/support/fake_clock.hpp"

namespace loopwarden::daemon::gateway::gateway_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

const Bytes kAcknowledgeAll{0, 1, 0, 0, 0, 6, 1, 5, 0, 0, 0xFF, 0};

Bytes heartbeat(std::uint8_t number) { return {0, 2, 0, 0, 0, 6, 1, 6, 0, 0, 0, number}; }

class Master {
 public:
  explicit Master(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  }
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;
  ~Master() { ::close(fd_); }

  void send(const Bytes& bytes) const {
    REQUIRE(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(bytes.size()));
  }
  Bytes received() const {
    std::array<std::uint8_t, 512> some{};
    const ssize_t n = ::recv(fd_, some.data(), some.size(), MSG_DONTWAIT);
    return {some.begin(), some.begin() + (n > 0 ? n : 0)};
  }

 private:
  int fd_;
};

// A master that must be heard every 3 s. Otherwise all loops change to manual.
struct Bench {
  static GatewaySettings settings() {
    GatewaySettings settings;
    settings.tcp.port = 0;
    settings.peers.push_back({*base::parse_network("127.0.0.0/8"), true});
    settings.writes = true;
    settings.master_heartbeat = {.timeout_s = 3.0, .action = MasterLossAction::manual};
    return settings;
  }

  void rounds(int count, double each_s = 0.01) {
    for (int i = 0; i < count; ++i) {
      pass(each_s);
      gateway.serve(std::chrono::milliseconds(0));
    }
  }
  void pass(double seconds) {
    clock.sleep_until_ns(clock.now_ns() + static_cast<std::int64_t>(seconds * 1e9));
  }
  bool lost() const { return gateway.state().master_lost; }

  tests::FakeClock clock;
  tests::FakeLoops loops{60};
  Gateway gateway{settings(), loops, clock};
};

}  // namespace

TEST_CASE("while an acknowledgement waits for a slow disk, heartbeats are read", "[gateway]") {
  Bench bench;
  const Master operators(bench.gateway.port());
  const Master leader(bench.gateway.port());
  leader.send(heartbeat(1));
  bench.rounds(3);
  CHECK(leader.received() == heartbeat(1));
  bench.loops.on_disk = 0;  // the disk is slow
  operators.send(kAcknowledgeAll);
  bench.rounds(2);
  REQUIRE(bench.loops.acknowledged_by.size() == 1);
  const std::uint64_t ticks = bench.gateway.ticks();
  leader.send(heartbeat(2));
  bench.rounds(2);
  CHECK(leader.received() == heartbeat(2));
  CHECK(bench.gateway.state().master_heartbeat == 2);
  CHECK(bench.gateway.ticks() == ticks + 2);
  CHECK(operators.received().empty());
  bench.loops.on_disk = bench.loops.newest_ticket;
  bench.rounds(1);
  CHECK(operators.received() == kAcknowledgeAll);
  CHECK_FALSE(bench.lost());
  CHECK(bench.loops.commands.empty());
}

TEST_CASE("a disk that does not answer delays an acknowledgement by 250 ms, and only once",
          "[gateway]") {
  Bench bench;
  const Master master(bench.gateway.port());
  bench.rounds(1);
  bench.loops.on_disk = 0;
  master.send(kAcknowledgeAll);
  bench.rounds(1);
  bench.rounds(24);
  CHECK(master.received().empty());
  bench.rounds(2);
  CHECK(master.received() == kAcknowledgeAll);
}

TEST_CASE("a delayed round judges no heartbeat", "[gateway]") {
  Bench bench;
  const Master operators(bench.gateway.port());
  const Master leader(bench.gateway.port());
  leader.send(heartbeat(1));
  bench.rounds(3);
  // The thread is held up. Meanwhile the leader writes, and its message is not read.
  bench.loops.on_action = [&] {
    leader.send(heartbeat(2));
    bench.pass(15.0);
  };
  operators.send(kAcknowledgeAll);
  bench.rounds(3);
  CHECK(leader.received().size() == 2 * heartbeat(1).size());
  CHECK_FALSE(bench.lost());
  CHECK(bench.loops.commands.empty());
  // The leader falls silent for good. Watched loops, which another controller runs, are not
  // affected.
  bench.loops.watched = {58, 59};
  bench.loops.on_action = {};
  bench.rounds(29, 0.1);
  CHECK_FALSE(bench.lost());
  bench.rounds(2, 0.1);
  CHECK(bench.lost());
  CHECK(bench.loops.commands.size() == 58);
}

}  // namespace loopwarden::daemon::gateway::gateway_test
