// SPDX-License-Identifier: Apache-2.0
// Optional parts of the daemon fail at the start: one at a time, and all together. The test steps
// the loops with its own time.
#include "daemon/app/assemble.hpp"

#include <catch2/catch.hpp>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/config/config_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::start_failures_test {
namespace {

namespace fs = std::filesystem;
namespace test = config::test;

constexpr double kSetPoint = 5.0;
constexpr std::int64_t kPeriod_ns = 100'000'000;
constexpr int kCycles = 1200;

// A port of this host that another program uses.
class TakenPort {
 public:
  TakenPort() {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0);
    REQUIRE(::listen(fd_, 1) == 0);
    socklen_t size = sizeof any;
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&any), &size);
    number_ = ntohs(any.sin_port);
  }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  ~TakenPort() { ::close(fd_); }
  std::uint16_t number() const { return number_; }

 private:
  int fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::uint16_t number_ = 0;
};

// Two simulated loops in AUTO, with every optional part configured.
struct Box {
  Box() {
    folder.write("m.yaml", test::kModel);
    for (const char* name : {"FIC-101", "FIC-102"}) {
      std::string loop = test::with(test::kLoopHead, "FIC-101", name);
      // Without its last command a loop would otherwise wait in manual.
      loop = test::with(loop, "mode: manual", "mode: automatic, after_restart: file");
      folder.write(fmt::format("loops.d/{}.yaml", name),
                   loop + "io: {backend: simulated, model: ../m.yaml}\n");
    }
    folder.write("loopwardend.yaml",
                 "modbus_server: {port: 1502, serial: {device: /dev/none, unit: 4}}\n"
                 "feeders: {dcs: {user: root}}\n"
                 "page: {alarms: true}\n"
                 "edge: {alarms: true}\n"
                 "real_time: {lock_memory: false}\n");
    auto read = config::read_configuration(folder.path());
    INFO(config::to_text(read.diagnostics));
    REQUIRE(read);
    configuration = std::move(*read);
    configuration.daemon.runtime_directory = runtime().string();
    configuration.daemon.state_directory = state().string();
    configuration.daemon.modbus_server->port = 0;
    fs::create_directories(runtime());
    fs::create_directories(state());
  }
  fs::path runtime() const { return folder.path() / "run"; }
  fs::path state() const { return folder.path() / "state"; }
  // A folder that is not empty has the name of a file that the daemon needs.
  static void block(const fs::path& file) { fs::create_directories(file / "in" / "the" / "way"); }

  test::ScratchFolder folder;
  TakenPort taken;
  config::Configuration configuration;
};

struct Failure {
  std::string part;
  std::function<void(Box&)> cause;
};

const std::vector<Failure>& failures() {
  static const std::vector<Failure> all{
      {"Modbus port",
       [](Box& box) { box.configuration.daemon.modbus_server->port = box.taken.number(); }},
      {"Modbus address",
       [](Box& box) { box.configuration.daemon.modbus_server->address = "192.0.2.1"; }},
      {"control.sock", [](Box& box) { Box::block(box.runtime() / "control.sock"); }},
      {"status.sock", [](Box& box) { Box::block(box.runtime() / "status.sock"); }},
      {"page.sock", [](Box& box) { Box::block(box.runtime() / "page.sock"); }},
      {"edge.sock", [](Box& box) { Box::block(box.runtime() / "edge.sock"); }},
      {"feed.sock", [](Box& box) { Box::block(box.runtime() / "feed.sock"); }},
      {"journal", [](Box& box) { Box::block(box.state() / "journal.sqlite"); }},
      {"alarm states", [](Box& box) { Box::block(box.state() / "alarm-state.json"); }},
      {"last orders", [](Box& box) { Box::block(box.state() / "last-orders.json"); }},
      {"evidence", [](Box& box) { tests::write_file(box.state() / "evidence", "in the way"); }},
      {"reports", [](Box& box) { tests::write_file(box.state() / "reports", "in the way"); }},
      {"state directory",
       [](Box& box) {
         tests::write_file(box.folder.path() / "file", "no folder");
         box.configuration.daemon.state_directory = (box.folder.path() / "file/state").string();
       }},
      {"runtime directory",
       [](Box& box) {
         tests::write_file(box.folder.path() / "file", "no folder");
         box.configuration.daemon.runtime_directory = (box.folder.path() / "file/run").string();
       }},
  };
  return all;
}

// Makes and starts the daemon's parts, and requires that both loops reach their set points.
std::vector<std::string> run_loops(Box& box) {
  const config::Specialists none;
  ServiceManager service;
  Assembly parts(box.configuration, box.folder.path(), none, {}, service);
  REQUIRE(parts.loops.all().size() == 2);
  for (LoopRuntime& loop : parts.loops.all()) loop.device().open();
  parts.journal.start();
  parts.evidence.start();
  parts.control.start();
  parts.readers.start();
  parts.elsewhere.start();
  parts.modbus->gateway.start();
  for (LoopRuntime& loop : parts.loops.all()) {
    record::RecordRow row;
    int rows = 0;
    for (int i = 0; i < kCycles; ++i) {
      loop.cycle->run({.now_ns = i * kPeriod_ns, .period_index = static_cast<std::uint64_t>(i)}, 0,
                      false);
      while (loop.channels->records.try_pop(row)) ++rows;
    }
    INFO(loop.config.name);
    CHECK(rows == kCycles);
    CHECK(row.fault == control::Fault::none);
    CHECK(row.pv == Approx(kSetPoint).margin(0.2));
  }
  std::vector<std::string> problems = parts.control.problems();
  for (const std::string& problem :
       {parts.readers.problem(), parts.elsewhere.problem(), parts.modbus->gateway.problem()}) {
    if (!problem.empty()) problems.push_back(problem);
  }
  parts.elsewhere.stop();
  parts.modbus->gateway.stop();
  parts.control.stop();
  parts.readers.stop();
  parts.evidence.store().stop();
  parts.evidence.explainer().stop();
  parts.journal.stop();
  for (LoopRuntime& loop : parts.loops.all()) loop.device().close();
  return problems;
}

}  // namespace

TEST_CASE("without a failure the loops run, and no part has a problem", "[start]") {
  Box box;
  CHECK(run_loops(box).empty());
}

TEST_CASE("if one optional part fails at the start, all loops run", "[start]") {
  for (const Failure& failure : failures()) {
    DYNAMIC_SECTION(failure.part) {
      Box box;
      failure.cause(box);
      const std::vector<std::string> problems = run_loops(box);
      const bool is_socket = failure.part.find(".sock") != std::string::npos;
      if (is_socket || failure.part.find("Modbus") == 0) {
        REQUIRE(problems.size() == 1);
        CHECK_THAT(problems.front(), Catch::Contains(is_socket ? failure.part : "Modbus server"));
      }
    }
  }
}

TEST_CASE("if all optional parts fail at the start, all loops run", "[start]") {
  Box box;
  for (const Failure& failure : failures()) failure.cause(box);
  box.configuration.daemon.modbus_server->address = "127.0.0.1";  // its port is in use
  CHECK(run_loops(box).size() == 6);
}

}  // namespace loopwarden::daemon::start_failures_test
