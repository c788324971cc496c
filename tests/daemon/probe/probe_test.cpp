// SPDX-License-Identifier: Apache-2.0
#include "daemon/probe/probe.hpp"

#include <catch2/catch.hpp>
#include <poll.h>
#include <pty.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "base/file.hpp"
#include "daemon/gateway/serial_server.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::probe_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A serial line with unit 1 at its other end: 7 in each input register, no holding registers.
class Line {
 public:
  Line() {
    std::array<char, 128> path{};
    int master = -1, slave = -1;
    REQUIRE(::openpty(&master, &slave, path.data(), nullptr, nullptr) == 0);
    master_ = base::File(master);
    slave_ = base::File(slave);
    device = path.data();
    thread_ = std::thread([this] { answer(); });
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() { end(); }

  // Ends the device and returns every request that it received.
  const std::vector<Bytes>& end() {
    quit_ = true;
    if (thread_.joinable()) thread_.join();
    return asked_;
  }

  std::string device;

 private:
  void answer() {
    constexpr std::size_t kReadRequestBytes = 8;
    Bytes request;
    while (!quit_) {
      pollfd waiting{master_.fd(), POLLIN, 0};
      std::uint8_t byte = 0;
      if (::poll(&waiting, 1, 20) <= 0 || ::read(master_.fd(), &byte, 1) != 1) continue;
      request.push_back(byte);
      if (request.size() < kReadRequestBytes) continue;
      asked_.push_back(request);
      if (request[0] == 1 && request[1] == 4) send({1, 4, 2, 0, 7});
      if (request[0] == 1 && request[1] == 3) send({1, 0x83, 2});
      request.clear();
    }
  }
  void send(Bytes bytes) const {
    const std::uint16_t checksum = gateway::serial_checksum(bytes);
    bytes.push_back(static_cast<std::uint8_t>(checksum & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(checksum >> 8U));
    (void)!::write(master_.fd(), bytes.data(), bytes.size());
  }

  base::File master_, slave_;
  std::atomic<bool> quit_{false};
  std::vector<Bytes> asked_;
  std::thread thread_;
};

}  // namespace

TEST_CASE("units on a serial line are found only by read requests", "[probe]") {
  const tests::TemporaryFolder folder;
  Line line;
  probe::Prober prober(folder.path());
  protocol::Probe asked{.transport = "rtu", .device = line.device, .table = "input"};
  const protocol::Probed read = prober.read(asked);
  INFO(read.why);
  CHECK(read.state == "read");
  CHECK(read.raw == 7.0);
  asked.table = "holding";
  CHECK(prober.read(asked).state == "error");
  asked.unit = 2;
  CHECK(prober.read(asked).state == "silent");
  const std::vector<Bytes>& requests = line.end();
  REQUIRE(requests.size() >= 3);
  for (const Bytes& request : requests) {
    CHECK((request[0] == 1 || request[0] == 2));
    CHECK((request[1] == 3 || request[1] == 4));
  }
}

}  // namespace loopwarden::daemon::probe_test
