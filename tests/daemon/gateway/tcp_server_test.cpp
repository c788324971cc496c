// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/tcp_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "tests/support/fake_clock.hpp"

namespace loopwarden::daemon::gateway::tcp_server_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::chrono::milliseconds kNoWait{0};

// The client's end of a connection, as in any program.
class Client {
 public:
  explicit Client(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const int small = 4096;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    REQUIRE(::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { ::close(fd_); }

  void send(const Bytes& bytes) const {
    ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  Bytes received() const {
    Bytes all;
    std::array<std::uint8_t, 4096> some{};
    for (;;) {
      const ssize_t n = ::recv(fd_, some.data(), some.size(), MSG_DONTWAIT);
      if (n <= 0) return all;
      all.insert(all.end(), some.begin(), some.begin() + n);
    }
  }
  bool closed() const {
    std::uint8_t byte = 0;
    const ssize_t n = ::recv(fd_, &byte, 1, MSG_DONTWAIT | MSG_PEEK);
    return n == 0 || (n < 0 && errno != EAGAIN);
  }
  void shut_down() const { ::shutdown(fd_, SHUT_WR); }

 private:
  int fd_;
};

Bytes frame(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
  Bytes bytes(7 + pdu.size());
  bytes[0] = static_cast<std::uint8_t>(transaction >> 8);
  bytes[1] = static_cast<std::uint8_t>(transaction);
  bytes[4] = static_cast<std::uint8_t>((pdu.size() + 1) >> 8);
  bytes[5] = static_cast<std::uint8_t>(pdu.size() + 1);
  bytes[6] = unit;
  for (std::size_t i = 0; i < pdu.size(); ++i) bytes[7 + i] = pdu[i];
  return bytes;
}

const Bytes kAsk{3, 0, 0, 0, 1};

// Answers every request with its own bytes. The clock moves only if the test moves it.
struct Bench {
  explicit Bench(TcpServerSettings settings = {}, const char* network = "127.0.0.0/8") {
    settings.port = 0;
    const base::PeerRule rule{*base::parse_network(network), true};
    server = std::make_unique<TcpServer>(
        settings, base::PeerList({rule}), clock,
        [this](std::span<const std::uint8_t> request, const Peer& peer) {
          last_peer = peer;
          Pdu pdu;
          std::copy(request.begin(), request.end(), pdu.bytes.begin());
          pdu.size = request.size();
          return Reply(pdu, ready);
        });
  }
  std::unique_ptr<Client> connect() {
    auto client = std::make_unique<Client>(server->port());
    rounds(2);
    return client;
  }
  void rounds(int count) {
    for (int i = 0; i < count; ++i) server->serve(kNoWait);
  }
  void pass(double seconds) {
    clock.sleep_until_ns(clock.now_ns() + static_cast<std::int64_t>(seconds * 1e9));
  }

  tests::FakeClock clock;
  Peer last_peer;
  std::function<bool()> ready;  // readiness of the next answers
  std::unique_ptr<TcpServer> server;
};

}  // namespace

TEST_CASE("a request is answered under its own transaction and unit", "[gateway][tcp]") {
  Bench bench;
  const auto client = bench.connect();
  client->send(frame(0xBEEF, 1, kAsk));
  bench.rounds(2);
  CHECK(client->received() == frame(0xBEEF, 1, kAsk));
  CHECK(bench.last_peer.name.find("127.0.0.1:") == 0);
  CHECK(bench.last_peer.may_write);
  for (const std::uint8_t unit : {std::uint8_t{0}, std::uint8_t{255}}) {
    client->send(frame(7, unit, kAsk));
    bench.rounds(2);
    CHECK(client->received() == frame(7, unit, kAsk));
  }
  client->send(frame(8, 9, kAsk));
  bench.rounds(2);
  CHECK(client->received() == frame(8, 9, {0x83, 0x0B}));
}

TEST_CASE("without descriptors the server pauses, and later serves the waiting clients",
          "[gateway][tcp]") {
  Bench bench;
  const Client client(bench.server->port());
  client.send(frame(1, 1, kAsk));
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{3, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  bench.rounds(1);
  setrlimit(RLIMIT_NOFILE, &before);
  bench.rounds(3);
  CHECK(client.received().empty());  // the next attempt is made later
  bench.pass(1.0);
  bench.rounds(3);
  CHECK(client.received() == frame(1, 1, kAsk));
}

TEST_CASE("a listening socket of the service manager is taken over", "[gateway][tcp]") {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in any{};
  any.sin_family = AF_INET;
  any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  REQUIRE(::bind(listener, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0);
  REQUIRE(::listen(listener, 4) == 0);
  TcpServerSettings settings;
  settings.listener = listener;
  settings.address = "no address";  // not looked at
  Bench bench(settings);
  const auto client = bench.connect();
  client->send(frame(2, 1, kAsk));
  bench.rounds(2);
  CHECK(client->received() == frame(2, 1, kAsk));
}

TEST_CASE("requests arrive in pieces, or several at once", "[gateway][tcp]") {
  Bench bench;
  const auto client = bench.connect();
  Bytes many;
  for (std::uint16_t i = 0; i < 20; ++i) {
    const Bytes one = frame(i, 1, kAsk);
    many.insert(many.end(), one.begin(), one.end());
  }
  SECTION("byte by byte") {
    for (const std::uint8_t byte : many) {
      client->send({byte});
      bench.rounds(1);
    }
  }
  SECTION("in one go") {
    client->send(many);
    bench.rounds(10);
  }
  bench.rounds(2);
  CHECK(client->received() == many);
}

TEST_CASE("a message that is no Modbus ends its own connection only", "[gateway][tcp]") {
  Bench bench;
  const auto other = bench.connect();
  const Bytes nonsense = GENERATE(Bytes{'G', 'E', 'T', ' '}, Bytes{0, 1, 0, 7, 0, 6, 1},
                                  Bytes{0, 1, 0, 0, 0, 1, 1}, Bytes{0, 1, 0, 0, 0, 0, 1},
                                  Bytes{0, 1, 0, 0, 0, 255, 1}, Bytes{0, 1, 0, 0, 1, 0, 1});
  const auto client = bench.connect();
  client->send(nonsense);
  bench.rounds(3);
  CHECK(client->closed());
  CHECK(bench.server->counters().malformed == 1);
  other->send(frame(1, 1, kAsk));
  bench.rounds(2);
  CHECK(other->received() == frame(1, 1, kAsk));
}

TEST_CASE("a client that is not on the list is turned away", "[gateway][tcp]") {
  Bench bench({}, "10.0.0.0/8");
  const auto client = bench.connect();
  CHECK(client->closed());
  CHECK(bench.server->counters().refused == 1);
  CHECK(bench.server->counters().clients == 0);
}

TEST_CASE("a client without a valid request is disconnected after the idle time",
          "[gateway][tcp]") {
  Bench bench({.idle_timeout_s = 60.0});
  const auto silent = bench.connect();
  const auto slow = bench.connect();
  const auto sound = bench.connect();
  for (int i = 0; i < 7; ++i) {  // one byte of a request every ten seconds
    bench.pass(10.0);
    slow->send({0});
    sound->send(frame(1, 1, kAsk));
    bench.rounds(2);
  }
  CHECK(silent->closed());
  CHECK(slow->closed());
  CHECK_FALSE(sound->closed());
}

TEST_CASE("a client that hangs up is forgotten; half-open ones are served to the end",
          "[gateway][tcp]") {
  Bench bench;
  {
    const auto client = bench.connect();
    CHECK(bench.server->counters().clients == 1);
  }
  bench.rounds(2);
  CHECK(bench.server->counters().clients == 0);
  const auto half = bench.connect();
  half->send(frame(3, 1, kAsk));
  bench.rounds(2);
  half->shut_down();
  bench.rounds(3);
  CHECK(bench.server->counters().clients == 0);
}

TEST_CASE("200 connections: the useful ones keep their places", "[gateway][tcp]") {
  Bench bench({.most_clients = 8});
  const auto master = bench.connect();
  master->send(frame(1, 1, kAsk));
  bench.rounds(2);
  REQUIRE(master->received().size() == frame(1, 1, kAsk).size());
  std::vector<std::unique_ptr<Client>> crowd;
  for (int i = 0; i < 200; ++i) {
    bench.pass(0.01);
    crowd.push_back(bench.connect());
  }
  CHECK(bench.server->counters().clients == 8);
  CHECK(bench.server->counters().displaced == 193);
  CHECK_FALSE(master->closed());
  master->send(frame(2, 1, kAsk));
  bench.rounds(2);
  CHECK(master->received() == frame(2, 1, kAsk));
}

TEST_CASE("among the useful clients the longest silent one is disconnected first",
          "[gateway][tcp]") {
  Bench bench({.most_clients = 2});
  const auto old = bench.connect();
  const auto recent = bench.connect();
  old->send(frame(1, 1, kAsk));
  bench.rounds(2);
  bench.pass(1.0);
  recent->send(frame(1, 1, kAsk));
  bench.rounds(2);
  const auto fresh = bench.connect();
  old->received();
  CHECK(old->closed());
  CHECK_FALSE(recent->received().empty());
  CHECK_FALSE(fresh->closed());
}

TEST_CASE("a client that asks too often waits, the others do not", "[gateway][tcp]") {
  Bench bench({.requests_per_second = 10.0});
  const auto greedy = bench.connect();
  const auto modest = bench.connect();
  const std::size_t size = frame(0, 1, kAsk).size();
  Bytes burst;
  for (std::uint16_t i = 0; i < 40; ++i) {
    const Bytes one = frame(i, 1, kAsk);
    burst.insert(burst.end(), one.begin(), one.end());
  }
  greedy->send(burst);
  bench.rounds(20);
  CHECK(greedy->received().size() == 10 * size);
  modest->send(frame(1, 1, kAsk));
  bench.rounds(2);
  CHECK(modest->received().size() == size);
  bench.pass(0.5);
  bench.rounds(20);
  CHECK(greedy->received().size() == 5 * size);
  for (int i = 0; i < 5; ++i) {
    bench.pass(1.0);
    bench.rounds(20);
  }
  CHECK(greedy->received().size() == 25 * size);  // no answer was lost
  CHECK_FALSE(greedy->closed());
}

TEST_CASE("a client that never reads its answers is not read from", "[gateway][tcp]") {
  Bench bench({.requests_per_second = 1e6});
  const auto deaf = bench.connect();
  const auto other = bench.connect();
  const Bytes request = frame(1, 1, Bytes(253, 3));
  for (int i = 0; i < 4'000; ++i) {
    deaf->send(request);
    bench.rounds(1);
    if (i % 1'000 == 0) {
      bench.pass(0.001);
      other->send(frame(1, 1, kAsk));
      bench.rounds(2);
      CHECK(other->received() == frame(1, 1, kAsk));
    }
  }
  // The server holds at most one answer for it.
  CHECK(bench.server->counters().requests < 4'000);
}

TEST_CASE("a waiting answer keeps only its client waiting", "[gateway][tcp]") {
  Bench bench;
  const auto waits = bench.connect();
  const auto other = bench.connect();
  bool there = false;
  bench.ready = [&] { return there; };
  waits->send(frame(1, 1, kAsk));
  bench.rounds(2);
  bench.ready = {};
  waits->send(frame(2, 1, kAsk));
  bench.rounds(3);
  CHECK(waits->received().empty());
  other->send(frame(3, 1, kAsk));
  bench.rounds(2);
  CHECK(other->received() == frame(3, 1, kAsk));
  CHECK(bench.server->counters().requests == 2);
  there = true;
  bench.rounds(3);
  Bytes both = frame(1, 1, kAsk);
  const Bytes second = frame(2, 1, kAsk);
  both.insert(both.end(), second.begin(), second.end());
  CHECK(waits->received() == both);
}

TEST_CASE("a client that left while its answer waited is forgotten with it", "[gateway][tcp]") {
  Bench bench;
  auto waits = bench.connect();
  bool there = false;
  bench.ready = [&] { return there; };
  waits->send(frame(1, 1, kAsk));
  bench.rounds(2);
  waits.reset();
  bench.rounds(2);
  there = true;
  bench.rounds(3);
  CHECK(bench.server->counters().clients == 0);
}

TEST_CASE("random and mutated frames: the server lives and serves the others", "[gateway][tcp]") {
  Bench bench({.most_clients = 16, .requests_per_second = 1e6});
  std::mt19937 random(11);
  const auto master = bench.connect();
  for (int round = 0; round < 2000; ++round) {
    const auto client = bench.connect();
    Bytes bytes = frame(static_cast<std::uint16_t>(random()), 1, kAsk);
    if (random() % 2 == 0) {
      bytes.resize(random() % 300);
      for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
    } else {
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    client->send(bytes);
    bench.rounds(1);
    if (round % 100 == 0) {
      master->send(frame(5, 1, kAsk));
      bench.rounds(2);
      REQUIRE(master->received() == frame(5, 1, kAsk));
    }
  }
}

TEST_CASE("an address that the host does not have yet is reported, and the server waits for it",
          "[gateway][tcp]") {
  Bench bench;
  CHECK(bench.server->problem().empty());
  Bench waits({.address = "192.0.2.1"});  // an address for documents
  CHECK(waits.server->problem() == "Modbus server: this host has no address 192.0.2.1");
  CHECK(waits.server->port() != 0);
  waits.rounds(2);
}

TEST_CASE("a port that is in use is reported, and opened once it is free", "[gateway][tcp]") {
  auto other = std::make_unique<Bench>();
  Bench bench;
  TcpServerSettings settings;
  settings.port = other->server->port();
  TcpServer waits(settings, base::PeerList({}), bench.clock,
                  [](std::span<const std::uint8_t>, const Peer&) { return Pdu{}; });
  CHECK(waits.port() == 0);
  CHECK_THAT(waits.problem(), Catch::Contains("in use"));
  other.reset();
  waits.serve(kNoWait);
  CHECK(waits.port() == 0);  // the next attempt follows after a second
  bench.pass(1.0);
  waits.serve(kNoWait);
  CHECK(waits.port() == settings.port);
  CHECK(waits.problem().empty());
}

}  // namespace loopwarden::daemon::gateway::tcp_server_test
