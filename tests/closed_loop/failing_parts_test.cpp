// SPDX-License-Identifier: Apache-2.0
// Optional parts of the daemon that fail at the start: the loops run, and each part works as soon
// as its obstacle is gone.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <pwd.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/daemon_process.hpp"
#include "tests/support/loop_file.hpp"

namespace loopwarden::tests::failing_parts_test {
namespace {

namespace fs = std::filesystem;

// A folder with content at the path of a file can be neither replaced nor opened for writing.
class Obstacle {
 public:
  explicit Obstacle(fs::path path) : path_(std::move(path)) {
    fs::create_directories(path_ / "content");
  }
  Obstacle(const Obstacle&) = delete;
  Obstacle& operator=(const Obstacle&) = delete;
  ~Obstacle() { remove(); }
  void remove() const {
    std::error_code gone;
    fs::remove_all(path_, gone);
  }

 private:
  fs::path path_;
};

const std::vector<std::string> kSockets{"control.sock", "status.sock", "page.sock", "edge.sock",
                                        "feed.sock"};
const std::vector<std::string> kFiles{"metrics.prom", "journal.sqlite", "alarm-state.json",
                                      "last-orders.json", "segments/FIC-101/0000000001.lwseg"};

std::string daemon_yaml() {
  const passwd* user = ::getpwuid(::getuid());
  return "real_time: {priority: 0, lock_memory: false}\npage: {alarms: true}\n"
         "edge: {alarms: true}\nfeeders: {program: {user: " +
         std::string(user == nullptr ? "root" : user->pw_name) + "}}\n";
}

}  // namespace

TEST_CASE("the loops run although optional parts fail at the start, and the parts work later",
          "[failing_parts]") {
  std::vector<std::string> broken;
  SECTION("all together") {
    broken = kSockets;
    broken.insert(broken.end(), kFiles.begin(), kFiles.end());
  }
  SECTION("one at a time") {
    std::vector<std::string> all = kSockets;
    all.insert(all.end(), kFiles.begin(), kFiles.end());
    broken = {GENERATE_COPY(from_range(all))};
  }
  CAPTURE(broken);
  DaemonProcess daemon(daemon_yaml(), {{"loops.d/1.yaml", loop_file("FIC-101")}});
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  for (const std::string& name : broken) {
    obstacles.push_back(std::make_unique<Obstacle>(daemon.folder() / name));
  }
  daemon.start(std::vector<std::string>{});
  // Printed after every loop has run once.
  REQUIRE(
      test::eventually([&] { return daemon.log().find("running 1 loop") != std::string::npos; }));
  for (const std::string& name : broken) {
    if (name.ends_with(".sock")) CHECK_THAT(daemon.log(), Catch::Contains(name));
  }
  obstacles.clear();
  REQUIRE(test::eventually([&] { return daemon.answers(); }));
  const auto cycles = daemon.status().at("daemon").at("ticks").get<std::uint64_t>();
  CHECK(test::eventually(
      [&] { return daemon.status().at("daemon").at("ticks").get<std::uint64_t>() > cycles; }));
  for (const std::string& name : kSockets) {
    CHECK(test::eventually([&] { return fs::is_socket(daemon.folder() / name); }));
  }
}

TEST_CASE("a second daemon for the same sockets does not start", "[failing_parts]") {
  DaemonProcess daemon(daemon_yaml(), {{"loops.d/1.yaml", loop_file("FIC-101")}});
  daemon.start();
  CHECK(daemon.run({"--config", daemon.config().string()}) == 74);
  CHECK_THAT(read_file(daemon.folder() / "output"),
             Catch::Contains("another daemon already listens"));
  CHECK(daemon.answers());
}

}  // namespace loopwarden::tests::failing_parts_test
