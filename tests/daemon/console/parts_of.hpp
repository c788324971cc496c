// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "daemon/console/parts.hpp"

namespace loopwarden::tests {

// A queue whose reports are never made.
inline daemon::reports::ReportDesk desk_in(const std::filesystem::path& folder,
                                           std::function<std::int64_t()> now_ms) {
  return {{.program = "/bin/true", .folder = folder / "reports", .socket = folder / "control.sock"},
          {.now_ms = std::move(now_ms),
           .wake = [] {},
           .ended = [](const daemon::reports::Report&) {},
           .in_use = [](const std::filesystem::path&) { return false; }}};
}

// Returns the parts of a test's bench that the sockets show.
template <class Bench>
daemon::console::Parts parts_of(Bench& bench, std::function<protocol::DaemonStatus()> status) {
  return {.loops = bench.loops,
          .historian = bench.historian,
          .board = bench.board,
          .box_alarms = bench.box_alarms,
          .journal = bench.journal,
          .evidence = bench.evidence,
          .reports = bench.reports,
          .severe_percent = 10.0,
          .daemon_status = std::move(status),
          .box_description = [] { return protocol::Description{.version = "test"}; },
          .links =
              [] {
                const auto tcp = [](const char* host, std::uint64_t port) {
                  return protocol::LinkInUse{
                      .by = "FIC-101 runs on it", .transport = "tcp", .host = host, .port = port};
                };
                return protocol::Links{
                    {tcp("10.0.0.1", 502),
                     tcp("2001:db8::1", 502),
                     tcp("127.0.0.1", 503),
                     {.by = "FIC-101 runs on it", .transport = "rtu", .device = "/dev/null"}}};
              },
          .configuration = bench.folder / "config",
          .config_hash = [] { return 17U; },
          .reload = [](const std::string&, bool, bool) { return std::uint64_t{1}; },
          .reload_state = [](std::uint64_t) { return protocol::ReloadState{"reading"}; },
          .twin = [](std::size_t) { return std::string(); },
          .box = [] { return daemon::gateway::BoxReading{.utc_ms = 1'800'000'000'123}; },
          .modbus_server = [] { return daemon::gateway::ServerState{}; }};
}

}  // namespace loopwarden::tests
