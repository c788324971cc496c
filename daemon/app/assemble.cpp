// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/assemble.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/app/attempt.hpp"
#include "daemon/app/reports_in_use.hpp"
#include "daemon/app/status.hpp"
#include "daemon/loops/loop_queue.hpp"
#include "daemon/loops/warm_start.hpp"
#include "daemon/recorder/flash_memory.hpp"
#include "model/twin/explain.hpp"
#include "model/watch/specialist_judge.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::daemon {
namespace {

using alarm::AlarmKind;

std::vector<supervision::SupervisedLoop> watched_loops(const config::Configuration& configuration) {
  std::vector<supervision::SupervisedLoop> loops;
  for (const config::LoopConfig& loop : configuration.loops) {
    supervision::SupervisedLoop& one = loops.emplace_back();
    one.name = loop.name;
    one.period_s = loop.sample_time_s;
    one.pv_unit = loop.pv_unit;
    for (const AlarmKind kind : alarm::kProcessAlarms) {
      if (loop.alarms.process.at(kind).fitted) one.fitted.push_back(kind);
    }
    for (const AlarmKind kind : alarm::kAlarmKinds) {
      one.priority[kind] = loop.alarms.priority[alarm::index_of(kind)];
    }
  }
  return loops;
}

console::Rights rights_of(const config::DaemonConfig& config) {
  return {.page = config.page, .edge = config.edge};
}

RecorderSettings recorder_settings(const config::DaemonConfig& config) {
  RecorderSettings settings{.state_directory = config.state_directory};
  if (config.recording.sync_s) {
    settings.sync = std::chrono::milliseconds(std::llround(1000.0 * *config.recording.sync_s));
  }
  return settings;
}

// Returns the B per day that the daemon may write; NaN: no limit. By default only flash memory has
// one.
double write_budget_b(const config::Configuration& configuration) {
  if (const auto& mb = configuration.daemon.recording.write_budget_mb) return 1e6 * *mb;
  if (!is_on_flash(configuration.daemon.state_directory)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  constexpr double kTimesRows = 4.0;
  constexpr double kOthers_b = 100e6;  // journal, evidence, reports
  double rows_b = 0.0;
  for (const config::LoopConfig& loop : configuration.loops) {
    if (!loop.recording.enabled) continue;
    rows_b +=
        record::kSegmentRowBytes * 86400.0 * configuration.daemon.accelerate / loop.sample_time_s;
  }
  return kTimesRows * rows_b + kOthers_b;
}

gateway::MasterLossAction action_of(config::ModbusServer::LossAction action) {
  switch (action) {
    case config::ModbusServer::LossAction::manual: return gateway::MasterLossAction::manual;
    case config::ModbusServer::LossAction::automatic: return gateway::MasterLossAction::automatic;
    case config::ModbusServer::LossAction::report: break;
  }
  return gateway::MasterLossAction::report;
}

std::optional<gateway::SerialServerSettings> serial_of(const config::ModbusServer& server) {
  if (!server.serial) return std::nullopt;
  return gateway::SerialServerSettings{
      .line = server.serial->line, .unit = server.serial->unit, .writes = server.serial->writes};
}

gateway::GatewaySettings gateway_settings(const config::ModbusServer& server) {
  return {.tcp = {.address = server.address,
                  .port = server.port,
                  .unit = server.unit,
                  .most_clients = server.most_clients,
                  .idle_timeout_s = server.idle_timeout_s,
                  .requests_per_second = server.requests_per_second,
                  .listener = modbus_listener()},
          .peers = server.clients,
          .writes = server.writes,
          .word_order = server.word_order,
          .master_heartbeat = {.timeout_s = server.master_timeout_s,
                               .action = action_of(server.on_master_loss)},
          .serial = serial_of(server)};
}

}  // namespace

ModbusServer::ModbusServer(const config::ModbusServer& server, const console::Plant& plant,
                           journal::Journal& journal, const console::DaemonInfo& info,
                           base::Clock& clock)
    : loops(plant, journal, info), gateway(gateway_settings(server), loops, clock) {}

Assembly::Assembly(config::Configuration from_files, const std::filesystem::path& folder,
                   const config::Specialists& specialists,
                   std::function<std::uint64_t()> log_lines_lost, ServiceManager& service)
    : configuration(std::move(from_files)),
      origin{
          .configuration = std::filesystem::absolute(folder / "").lexically_normal().parent_path(),
          .started_ns = loops.clock().now_ns(),
          .started_ms = base::utc_ms(),
          .model_hash = specialists.hash,
          .log_lines_lost = std::move(log_lines_lost)},
      historian(loops.all(), recorder_settings(configuration.daemon)),
      journal({.folder = configuration.daemon.state_directory}),
      alarms(watched_loops(configuration), configuration.daemon.alarms.settings, journal,
             base::utc_ms),
      box_alarms(configuration.daemon.alarms.settings, journal, base::utc_ms),
      outages(loops.all(), elsewhere.board(), alarms, box_alarms),
      box_looker(
          {.disk =
               [state = configuration.daemon.state_directory,
                certificates = configuration.daemon.certificates] {
                 return host::look_at_disk(state, certificates);
               },
           .status = [this] { return status_of(*this); },
           .lost_connections = [this](double uptime_s) { return outages.look(uptime_s); },
           .dropped = [this] { return historian.dropped(); },
           .failed_parts =
               [this] {
                 std::vector<std::string> all = control.problems();
                 for (std::string why : {readers.problem(), elsewhere.problem(),
                                         modbus ? modbus->gateway.problem() : std::string()}) {
                   if (!why.empty()) all.push_back(std::move(why));
                 }
                 return all;
               },
           .write_budget_b = write_budget_b(configuration)},
          box_alarms),
      reports({.program = workbench_program(),
               .folder = std::filesystem::path(configuration.daemon.state_directory) / "reports",
               .socket =
                   std::filesystem::path(configuration.daemon.runtime_directory) / "control.sock"},
              report_callbacks(folder)),
      evidence(configuration.daemon, specialists,
               {.loops = loops.all(),
                .alarms = alarms,
                .journal = journal,
                .config_hash = [this] { return reloader.config_hash(); },
                .history = [this](std::size_t loop) { return watching.monitor->history(loop); },
                .spare =
                    [this](const StopWork& stop) {
                      bool worked = false;
                      attempt("report", [&] { worked = reports.run_next(stop); });
                      return worked;
                    }}),
      reloader(configuration, folder, loops.all(), historian, journal, reloader_callbacks(service)),
      console_sources(*this),
      control(configuration.daemon.runtime_directory, plant(), archive(), console_sources,
              console_sources, rights_of(configuration.daemon)),
      readers(configuration.daemon.runtime_directory, plant(), archive(), console_sources) {
  if (configuration.daemon.real_time.lock_memory) loops.lock_memory();
  make_loops();
  const journal::AlarmStates remembered = journal.open();
  alarms.restore(remembered);
  box_alarms.restore(remembered);
  outages.restore();
  make_monitor(specialists);
  evidence.remember();
  if (configuration.daemon.modbus_server) {
    modbus = std::make_unique<ModbusServer>(*configuration.daemon.modbus_server, plant(), journal,
                                            console_sources, loops.clock());
  }
  // Each loop has its own part.
  configuration.loops = {};
  configuration.text = {};
}

// Makes the loops. A loop starts with the mode and set point from before the restart if its file
// requests it.
void Assembly::make_loops() {
  const LastCommandsFile file(std::filesystem::path(configuration.daemon.state_directory) /
                              "last-orders.json");
  LastCommands last = file.load();
  if (!last.damaged.empty()) spdlog::error("last orders are not known: {}", last.damaged);
  loops.make(configuration, [&](const config::LoopConfig& loop) {
    WarmStart warm = warm_start(loop, last);
    if (warm.line) {
      spdlog::info("loop {}: starts with {} (before: {}); {}", loop.name, warm.line->new_value,
                   warm.line->old_value, warm.line->reason);
      warm.line->utc_ms = base::utc_ms();
      journal.post(std::move(*warm.line));
    }
    return warm.start;
  });
  elsewhere.make(configuration, loops.backends(), loops.all());
  keeper = std::make_unique<CommandKeeper>(loops.all(), file, std::move(last));
}

void Assembly::make_monitor(const config::Specialists& specialists) {
  for (const auto& [name, specialist_folder] : specialists.folders) {
    watching.judges[name] =
        std::make_unique<watch::SpecialistJudge>(*specialist_folder.content.team);
  }
  std::vector<supervision::MonitoredLoop> monitored;
  for (LoopRuntime& loop : loops.all()) {
    // All loops of a specialist folder share one judge, because there is one monitor thread.
    const auto judge = watching.judges.find(loop.config.monitor.specialists);
    const auto twin = specialists.twins.find(loop.config.monitor.twin);
    monitored.push_back({.cycles = &loop.channels->watched,
                         .window = config::window_of(loop.config),
                         .judge = judge == watching.judges.end() ? nullptr : judge->second.get(),
                         .twin = twin == specialists.twins.end() ? nullptr : &twin->second,
                         .history_s = twin::kBefore_s + twin::kMostSeen_s,
                         .foreign_controller = config::is_watched(loop.config.io),
                         .rule = alarm::kAlarmRule,
                         .process = loop.config.alarms.process,
                         .pv_unit = loop.config.pv_unit,
                         .corrective = loop.config.monitor.corrective,
                         .channels = {.commands = &watching.queues.emplace_back(
                                          queue_of(loop, loop.channels->monitor_commands, journal)),
                                      .settings_taken = &loop.channels->settings_taken,
                                      .commissioned = &loop.channels->commissioned,
                                      .moves_settings = &loop.channels->moves_settings,
                                      .moves = &loop.channels->moves,
                                      .hardware = config::backing_of(loop.config.io).hardware},
                         .loop = loop.channels.get(),
                         .moves_lease = moves_lease(loop.config, configuration.daemon.accelerate)});
  }
  watching.monitor = std::make_unique<supervision::Monitor>(
      monitored, alarms,
      [this](std::size_t loop, alarm::AlarmKind alarm, const watch::LoopMonitor& loop_monitor,
             const watch::MonitorStep& step, alarm::AlarmReason reason) {
        evidence.keep(loop, alarm, loop_monitor, step, reason);
      });
}

reports::ReportCallbacks Assembly::report_callbacks(const std::filesystem::path& folder) {
  return {.now_ms = base::utc_ms,
          .wake = [this] { evidence.explainer().wake(); },
          .ended =
              [this](const reports::Report& report) {
                journal::JournalEntry line;
                line.kind = journal::JournalEntry::Kind::system;
                line.utc_ms = report.ended_ms;
                line.loop = report.order.loop;
                line.what = "report";
                line.new_value = report.name;
                line.result = report.state == reports::State::done ? "done" : "failed";
                line.reason = report.sentence;
                journal.post(std::move(line));
              },
          .in_use =
              [this, folder](const std::filesystem::path& report) {
                return needed_by_loops(report, loops.all(), folder);
              }};
}

ReloaderCallbacks Assembly::reloader_callbacks(ServiceManager& service) {
  return {.take_over =
              [this](const config::DaemonConfig& wanted) {
                configuration.daemon.stop_timeout_s = wanted.stop_timeout_s;
                control.set_rights(rights_of(wanted));
                spdlog::set_level(spdlog::level::from_str(wanted.log_level));
              },
          .reloading = [&service] { service.reloading(); },
          .ready = [&service] { service.ready(); }};
}

console::Plant Assembly::plant() {
  return {.loops = loops.all(),
          .historian = historian,
          .alarms = alarms,
          .box_alarms = box_alarms,
          .severe_percent = configuration.daemon.alarms.severe_percent};
}

console::Archive Assembly::archive() {
  return {.journal = journal, .evidence = evidence.store(), .reports = reports};
}

}  // namespace loopwarden::daemon
