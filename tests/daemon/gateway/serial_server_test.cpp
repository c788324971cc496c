// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/serial_server.hpp"

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <memory>
#include <random>
#include <vector>

#include "tests/support/fake_clock.hpp"

namespace loopwarden::daemon::gateway::serial_server_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes framed(Bytes bytes) {
  const std::uint16_t checksum = serial_checksum(bytes);
  bytes.push_back(static_cast<std::uint8_t>(checksum & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(checksum >> 8U));
  return bytes;
}

// A line with the server at one end. It answers every request with its own bytes.
struct Bench {
  explicit Bench(std::uint8_t unit = 7) {
    std::array<char, 128> path{};
    REQUIRE(::openpty(&master, &slave, path.data(), nullptr, nullptr) == 0);
    ::fcntl(master, F_SETFL, O_NONBLOCK);
    SerialServerSettings settings;
    settings.line.device = path.data();
    settings.line.baud = 9600;  // 3.5 characters are 4.01 ms
    settings.unit = unit;
    server = std::make_unique<SerialServer>(
        settings, clock, [this](std::span<const std::uint8_t> request, const Peer& peer) {
          asked.emplace_back(request.begin(), request.end());
          may_write = peer.may_write;
          Pdu pdu;
          std::copy(request.begin(), request.end(), pdu.bytes.begin());
          pdu.size = request.size();
          return Reply(pdu, ready);
        });
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() {
    if (master >= 0) ::close(master);
    ::close(slave);
  }
  void send(const Bytes& bytes) {
    REQUIRE(::write(master, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
    server->serve();
  }
  // Lets time pass without a byte.
  void silence(double ms) {
    clock.sleep_until_ns(clock.now_ns() + static_cast<std::int64_t>(ms * 1e6));
    server->serve();
  }
  Bytes received() {
    Bytes bytes(300);
    const ssize_t n = ::read(master, bytes.data(), bytes.size());
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }

  tests::FakeClock clock;
  int master = -1;
  int slave = -1;
  std::vector<Bytes> asked;
  bool may_write = true;
  std::function<bool()> ready;  // readiness of the next answers
  std::unique_ptr<SerialServer> server;
};

const Bytes kRead{7, 4, 0, 14, 0, 2};

}  // namespace

TEST_CASE("checksum and size of a request follow the specification", "[serial_server]") {
  // MODBUS over Serial Line V1.02, section 6.2.2: 02 07 gives 12 41 with the low byte first.
  CHECK(serial_checksum(Bytes{2, 7}) == 0x1241);
  CHECK(serial_request_size(kRead) == 8);
  CHECK(serial_request_size(Bytes{7, 16, 0, 0, 0, 2}) == 0);
  CHECK(serial_request_size(Bytes{7, 16, 0, 0, 0, 2, 4}) == 13);
  CHECK(serial_request_size(Bytes{7, 43}) == 7);
  CHECK(serial_request_size(Bytes{7, 99}) == 0);
  CHECK(serial_request_size(Bytes{7}) == 0);
}

TEST_CASE("a request is answered after the silence that ends it", "[serial_server]") {
  Bench bench;
  REQUIRE(bench.server->fd() >= 0);
  bench.send(framed(kRead));
  CHECK(bench.received().empty());
  CHECK(bench.server->patience() == std::chrono::milliseconds(5));
  bench.silence(4.0);
  CHECK(bench.asked.empty());
  bench.silence(0.1);
  REQUIRE(bench.asked.size() == 1);
  CHECK(bench.asked[0] == Bytes{4, 0, 14, 0, 2});
  CHECK(bench.received() == framed(kRead));
  CHECK_FALSE(bench.may_write);
  CHECK(bench.server->counters().requests == 1);
  CHECK(bench.server->patience() > std::chrono::milliseconds(100));
}

TEST_CASE("a request in pieces, as from loaded hosts and USB adapters", "[serial_server]") {
  Bench bench;
  const Bytes whole = framed(kRead);
  for (const std::uint8_t byte : whole) {
    bench.send({byte});
    bench.silence(30.0);
  }
  CHECK(bench.asked.size() == 1);
  // Too long a pause ends the request, and later bytes don't belong to it.
  bench.send(Bytes(whole.begin(), whole.begin() + 5));
  bench.silence(60.0);
  CHECK(bench.server->counters().malformed == 1);
  bench.send(whole);
  bench.silence(5.0);
  CHECK(bench.asked.size() == 2);
}

TEST_CASE("others' requests and answers are ignored; a broadcast is done and not answered",
          "[serial_server]") {
  Bench bench;
  bench.send(framed({9, 4, 0, 14, 0, 2}));
  bench.silence(5.0);
  bench.send(framed({9, 4, 4, 7, 7, 7, 7}));
  bench.silence(5.0);
  CHECK(bench.asked.empty());
  CHECK(bench.server->counters().malformed == 0);
  bench.send(framed({0, 6, 0, 0, 0, 1}));
  bench.silence(5.0);
  CHECK(bench.asked.size() == 1);
  CHECK(bench.received().empty());
}

TEST_CASE("noise on the line: counted, and the next request is answered", "[serial_server]") {
  Bench bench;
  Bytes wrong = framed(kRead);
  wrong[3] ^= 1;
  bench.send(wrong);
  bench.silence(5.0);
  CHECK(bench.server->counters().malformed == 1);
  std::mt19937 random(3);
  for (int i = 0; i < 50; ++i) {
    Bytes noise(1 + random() % 700);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    noise[0] = 7;
    bench.send(noise);
    bench.silence(60.0);
  }
  CHECK(bench.asked.empty());
  bench.send(framed(kRead));
  bench.silence(5.0);
  CHECK(bench.asked.size() == 1);
}

TEST_CASE("a waiting answer is sent when it may, or never once the master speaks again",
          "[serial_server]") {
  Bench bench;
  bool there = false;
  bench.ready = [&] { return there; };
  bench.send(framed(kRead));
  bench.silence(5.0);
  REQUIRE(bench.asked.size() == 1);
  CHECK(bench.received().empty());
  CHECK(bench.server->patience() <= std::chrono::milliseconds(10));
  there = true;
  bench.silence(1.0);
  CHECK(bench.received() == framed(kRead));
  bench.silence(1.0);
  CHECK(bench.received().empty());

  there = false;
  bench.send(framed(kRead));
  bench.silence(5.0);
  const Bytes second{7, 4, 0, 15, 0, 2};
  bench.ready = {};
  bench.send(framed(second));
  there = true;
  bench.silence(5.0);
  CHECK(bench.received() == framed(second));
}

TEST_CASE("a lost line is reported and opened again", "[serial_server]") {
  Bench bench;
  ::close(bench.master);
  bench.master = -1;
  bench.server->serve();
  CHECK(bench.server->fd() == -1);
  CHECK_FALSE(bench.server->counters().open);
  bench.silence(6000.0);  // tries without an exception
  SerialServerSettings settings;
  settings.line.device = "/dev/null/nowhere";
  SerialServer none(settings, bench.clock, {});
  CHECK(none.fd() == -1);
  none.serve();
}

}  // namespace loopwarden::daemon::gateway::serial_server_test
