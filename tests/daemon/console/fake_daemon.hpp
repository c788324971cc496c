// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "daemon/console/archive.hpp"
#include "daemon/console/daemon_info.hpp"
#include "daemon/console/operations.hpp"
#include "daemon/console/plant.hpp"

namespace loopwarden::tests {

// Nobody makes what is asked for.
inline daemon::reports::ReportQueue desk_in(const std::filesystem::path& folder,
                                            std::function<std::int64_t()> now_ms) {
  return {{.program = "/bin/true", .folder = folder / "reports", .socket = folder / "control.sock"},
          {.now_ms = std::move(now_ms),
           .wake = [] {},
           .ended = [](const daemon::reports::Report&) {},
           .in_use = [](const std::filesystem::path&) { return false; }}};
}

// The daemon around a test's loops, as the sockets see it.
class FakeDaemon final : public daemon::console::DaemonInfo, public daemon::console::Operations {
 public:
  FakeDaemon(std::filesystem::path folder, std::function<protocol::DaemonStatus()> status)
      : folder_(std::move(folder)), status_(std::move(status)) {}

  protocol::DaemonStatus status() const override { return status_(); }
  protocol::Description description() const override {
    return protocol::Description{.version = "test"};
  }
  protocol::Links links() const override {
    const auto tcp = [](const char* host, std::uint64_t port) {
      return protocol::LinkInUse{
          .by = "FIC-101 runs on it", .transport = "tcp", .host = host, .port = port};
    };
    return protocol::Links{
        {tcp("10.0.0.1", 502),
         tcp("2001:db8::1", 502),
         tcp("127.0.0.1", 503),
         {.by = "FIC-101 runs on it", .transport = "rtu", .device = "/dev/null"}}};
  }
  std::filesystem::path configuration() const override { return folder_ / "config"; }
  std::uint32_t config_hash() const override { return 17; }
  std::string twin(std::size_t) const override { return {}; }
  daemon::gateway::BoxReading box() const override {
    return daemon::gateway::BoxReading{.utc_ms = 1'800'000'000'123};
  }
  daemon::gateway::ServerState modbus_server() const override { return {}; }

  std::uint64_t reload(const std::string&, bool, bool) override { return 1; }
  std::optional<protocol::ReloadState> reload_state(std::uint64_t) const override {
    return protocol::ReloadState{"reading"};
  }
  bool command_kept(std::size_t) const override { return true; }

 private:
  std::filesystem::path folder_;
  std::function<protocol::DaemonStatus()> status_;
};

template <class Bench>
daemon::console::Plant plant_of(Bench& bench) {
  return {.loops = bench.loops,
          .historian = bench.historian,
          .alarms = bench.board,
          .box_alarms = bench.box_alarms,
          .severe_percent = 10.0};
}

template <class Bench>
daemon::console::Archive archive_of(Bench& bench) {
  return {.journal = bench.journal, .evidence = bench.evidence, .reports = bench.reports};
}

}  // namespace loopwarden::tests
