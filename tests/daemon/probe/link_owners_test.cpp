// SPDX-License-Identifier: Apache-2.0
#include "daemon/probe/link_owners.hpp"

#include <catch2/catch.hpp>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>

#include "base/file.hpp"
#include "daemon/probe/probe.hpp"
#include "tests/daemon/console/console.hpp"

namespace loopwarden::daemon::link_owners_test {
namespace {

using hal::modbus::LinkSettings;

LinkSettings tcp(const std::string& host, std::uint16_t port = 502) {
  LinkSettings link;
  link.host = host;
  link.port = port;
  return link;
}

}  // namespace

TEST_CASE("a link belongs to the daemon by its address, in any notation", "[probe]") {
  console_bench::Console bench;
  bench.readers->start();
  const std::filesystem::path folder = bench.folder / "config";
  tests::write_file(folder / "loopwardend.yaml",
                    "runtime_directory: " + bench.folder.path().string() + "\n");
  // In use: 10.0.0.1 port 502, [2001:db8::1] port 502 and 127.0.0.1 port 503.
  const auto owner = [&](const LinkSettings& link) { return probe::owner_of(link, folder); };
  const std::string by = "FIC-101 runs on it";
  CHECK(owner(tcp("10.0.0.1")) == by);
  CHECK(owner(tcp("::ffff:10.0.0.1")) == by);
  CHECK(owner(tcp("2001:0db8:0:0::0001")) == by);
  CHECK(owner(tcp("localhost", 503)) == by);
  CHECK(owner(tcp("10.0.0.2")).empty());
  CHECK(owner(tcp("10.0.0.1", 503)).empty());
  LinkSettings line;
  line.transport = hal::modbus::Transport::rtu;
  line.device = (bench.folder / "line").string();
  CHECK(owner(line).empty());
  std::filesystem::create_symlink("/dev/null", bench.folder / "line");
  CHECK(owner(line) == by);
  bench.readers->stop();
}

TEST_CASE("a serial line that another program has locked is not used", "[probe]") {
  const tests::TemporaryFolder folder;
  const base::File master(::posix_openpt(O_RDWR | O_NOCTTY));
  REQUIRE(::grantpt(master.fd()) == 0);
  REQUIRE(::unlockpt(master.fd()) == 0);
  const std::string device = ::ptsname(master.fd());
  const protocol::Probe asked{.transport = "rtu", .device = device, .table = "input"};
  probe::Prober prober(folder.path());
  {
    const base::File other(device, O_RDWR | O_NOCTTY);
    REQUIRE(::flock(other.fd(), LOCK_EX) == 0);
    const protocol::Probed refused = prober.read(asked);
    CHECK(refused.state == "refused");
    CHECK(refused.why == "another program has locked " + device);
  }
  CHECK(prober.read(asked).state == "silent");
  // From here on the other program has the lock.
  const base::File other(device, O_RDWR | O_NOCTTY);
  CHECK(::flock(other.fd(), LOCK_EX | LOCK_NB) != 0);
}

}  // namespace loopwarden::daemon::link_owners_test
