// SPDX-License-Identifier: Apache-2.0
// The daemon's parts, created and connected, but not running yet.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "daemon/commands/command_queue.hpp"
#include "daemon/loops/command_keeper.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/console_sources.hpp"
#include "daemon/app/evidence_flow.hpp"
#include "daemon/app/gateway_loops.hpp"
#include "daemon/app/real_time_loops.hpp"
#include "daemon/app/reloader.hpp"
#include "config/validation/specialist_files.hpp"
#include "daemon/app/watchdog.hpp"
#include "daemon/app/watched_loops.hpp"
#include "daemon/app/outages.hpp"
#include "daemon/host/host_alarms.hpp"
#include "daemon/host/host_probe.hpp"
#include "daemon/console/control_server.hpp"
#include "daemon/console/status_server.hpp"
#include "daemon/gateway/gateway.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/supervision/monitor.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/reports/report_queue.hpp"

namespace loopwarden::daemon {

// Values that are fixed from the start to the end.
struct Origin {
  std::filesystem::path configuration;            // absolute
  std::int64_t started_ns;                        // monotonic
  std::int64_t started_ms;                        // UTC
  std::uint32_t model_hash;                       // hash of the specialists; 0: not configured
  std::function<std::uint64_t()> log_lines_lost;  // may be empty
};

// The monitor and the parts that it uses.
struct Watching {
  std::map<std::string, std::unique_ptr<alarm::WindowJudge>> judges;  // by folder
  std::deque<commands::CommandQueue> queues;                          // one per loop
  std::unique_ptr<supervision::Monitor> monitor;
};

struct ModbusServer {
  ModbusServer(const config::ModbusServer& server, const console::Plant& plant,
               journal::Journal& journal, const console::DaemonInfo& info, base::Clock& clock);

  GatewayLoops loops;
  gateway::Gateway gateway;
};

struct Assembly {
  // Makes everything that can fail: backends, channels and sockets. Throws std::runtime_error.
  // `specialists` and `service` must outlive this.
  Assembly(config::Configuration from_files, const std::filesystem::path& folder,
           const config::Specialists& specialists, std::function<std::uint64_t()> log_lines_lost,
           ServiceManager& service);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;
  ~Assembly() = default;

  config::Configuration configuration;  // without loops and text once the loops are made
  RealTimeLoops loops;
  WatchedLoops elsewhere{loops.clock()};
  Origin origin;
  Historian historian;
  journal::Journal journal;
  supervision::AlarmRegistry alarms;
  host::HostAlarms box_alarms;
  Outages outages;
  host::HostProbe box_looker;
  reports::ReportQueue reports;
  EvidenceFlow evidence;
  Watching watching;
  Reloader reloader;
  ConsoleSources console_sources;
  ControlServer control;
  StatusServer readers;
  std::unique_ptr<ModbusServer> modbus;  // null: not configured
  std::unique_ptr<CommandKeeper> keeper;

 private:
  reports::ReportCallbacks report_callbacks(const std::filesystem::path& folder);
  console::Plant plant();
  console::Archive archive();
  ReloaderCallbacks reloader_callbacks(ServiceManager& service);
  void make_loops();
  void make_monitor(const config::Specialists& specialists);
};

}  // namespace loopwarden::daemon
