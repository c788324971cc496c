// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/status.hpp"

#include <algorithm>
#include <optional>

#include "base/clock.hpp"
#include "daemon/app/assemble.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon {

namespace {

double microseconds(std::int64_t ns) { return static_cast<double>(ns) / 1000.0; }

double uptime_s(const Assembly& parts) {
  return static_cast<double>(base::MonotonicClock().now_ns() - parts.origin.started_ns) / 1e9;
}

protocol::Histogram histogram_of(const rt::LatencyHistogram& h) {
  return {.p50 = microseconds(h.quantile_ns(0.5)),
          .p99 = microseconds(h.quantile_ns(0.99)),
          .p99_9 = microseconds(h.quantile_ns(0.999)),
          .worst = microseconds(h.worst_ns),
          .sum = microseconds(h.sum_ns),
          .bins = {h.bins.begin(), h.bins.end()}};
}

protocol::JournalStatus journal_of(const journal::Journal& journal) {
  const journal::JournalStatus lines = journal.status();
  return {.error = lines.error,
          .file = journal.path().string(),
          .written = lines.written,
          .waiting = lines.waiting,
          .lost = lines.lost,
          .damaged = lines.damaged};
}

protocol::RecorderStatus recorder_of(const Assembly& parts) {
  const host::WriteRate writes = parts.box_looker.writes();
  return {.disk_wait_s = parts.historian.recorder().disk_wait_s(),
          .sync_s = parts.historian.recorder().sync_s(),
          .written_bytes = writes.bytes,
          .written_mb_per_day = writes.per_day_b ? *writes.per_day_b / 1e6 : protocol::kNone,
          .write_budget_mb_per_day = parts.box_looker.write_budget_b() / 1e6};
}

protocol::EvidenceStatus evidence_of(const EvidenceStatus& kept) {
  return {.error = kept.error,
          .removal_error = kept.removal_error,
          .written = kept.written,
          .waiting = kept.waiting,
          .lost = kept.lost};
}

protocol::ExplanationsStatus explanations_of(const ExplainerStatus& explained) {
  return {
      .explained = explained.explained, .failed = explained.failed, .waiting = explained.waiting};
}

protocol::MonitorStatus monitor_of(const supervision::MonitorStatus& watched) {
  return {.windows = watched.windows,
          .cycles = watched.cycles,
          .dropped = watched.dropped,
          .backlog = watched.backlog};
}

protocol::ModbusServer modbus_of(const gateway::Gateway& gateway) {
  const gateway::TcpServerCounters c = gateway.counters();
  protocol::ModbusServer server{.port = gateway.port(),
                                .clients = c.clients,
                                .requests = c.requests,
                                .accepted = c.accepted,
                                .refused = c.refused,
                                .displaced = c.displaced,
                                .malformed = c.malformed};
  if (const auto serial = gateway.serial_counters()) {
    server.serial = protocol::SerialServer{serial->open, serial->requests, serial->malformed};
  }
  return server;
}

protocol::SocketRights rights_of(const config::SocketRights& rights) {
  return {.alarms = rights.alarms,
          .control = rights.control,
          .tuning = rights.tuning,
          .reports = rights.reports,
          .tests = rights.tests};
}

}  // namespace

protocol::DaemonStatus status_of(const Assembly& parts) {
  const rt::RunnerStatus runner = parts.loops.status();
  return {.version = LOOPWARDEN_VERSION,
          .config_hash = parts.reloader.config_hash(),
          .model_hash = parts.origin.model_hash,
          .configuration = parts.reloader.status(),
          .recorder = recorder_of(parts),
          .log_lines_lost = parts.origin.log_lines_lost ? parts.origin.log_lines_lost() : 0,
          .journal = journal_of(parts.journal),
          .evidence = evidence_of(parts.evidence.store().status()),
          .explanations = explanations_of(parts.evidence.explainer().status()),
          .monitor = monitor_of(parts.watching.monitor->status()),
          .modbus_server =
              parts.modbus ? std::optional(modbus_of(parts.modbus->gateway)) : std::nullopt,
          .feeders = parts.elsewhere.feeders(base::MonotonicClock().now_ns()),
          .connections = parts.outages.connections(),
          .uptime_s = uptime_s(parts),
          .accelerate = parts.configuration.daemon.accelerate,
          .real_time_missing = parts.loops.rights_missing(),
          .ticks = runner.ticks,
          .overruns = runner.overruns,
          .skipped_ticks = runner.skipped_ticks,
          .events_dropped = parts.loops.events_dropped(),
          .wake_up_us = histogram_of(runner.wake_up),
          .work_us = histogram_of(runner.work)};
}

protocol::Description description_of(const Assembly& parts) {
  const console::Rights rights = parts.control.rights();
  const config::DaemonConfig& config = parts.configuration.daemon;
  const config::Alarms& alarms = config.alarms;
  return {.version = LOOPWARDEN_VERSION,
          .config_hash = parts.reloader.config_hash(),
          .model_hash = parts.origin.model_hash,
          .accelerate = config.accelerate,
          .started_ms = parts.origin.started_ms,
          .state_directory = config.state_directory,
          .page = rights_of(rights.page),
          .edge = rights_of(rights.edge),
          .alarms = {.severe_percent = alarms.severe_percent,
                     .latching = alarms.settings.latching,
                     .shelve_limit_min = alarms.settings.shelve_limit_ms / 60'000}};
}

protocol::Links links_of(const Assembly& parts) {
  using hal::modbus::LinkSettings;
  protocol::Links all;
  const auto add = [&](const LinkSettings& link, const std::string& by) {
    const bool tcp = link.transport == hal::modbus::Transport::tcp;
    all.links.push_back({.by = by,
                         .transport = tcp ? "tcp" : "rtu",
                         .host = tcp ? link.host : "",
                         .port = tcp ? link.port : 0U,
                         .device = tcp ? "" : link.device});
  };
  for (const LoopRuntime& loop : parts.loops.all()) {
    const std::string by = loop.config.name + " runs on it";
    if (const auto* io = std::get_if<hal::modbus::LoopModbusSettings>(&loop.config.io)) {
      add(io->transmitter_link, by);
      add(io->positioner_link, by);
    } else if (const auto* source =
                   std::get_if<hal::modbus::ModbusSourceSettings>(&loop.config.io)) {
      add(source->process_variable.link, by);
      add(source->output.link, by);
      for (const auto* point : {&source->set_point, &source->stem, &source->mode}) {
        if (*point) add((*point)->link, by);
      }
    }
  }
  const auto& server = parts.configuration.daemon.modbus_server;
  if (server && server->serial) {
    add(server->serial->line, "the daemon answers its masters on it");
  }
  return all;
}

gateway::BoxReading box_reading_of(const Assembly& parts) {
  const rt::RunnerStatus runner = parts.loops.status();
  const journal::JournalStatus lines = parts.journal.status();
  const supervision::MonitorStatus watched = parts.watching.monitor->status();
  const std::vector<LoopRuntime>& loops = parts.loops.all();
  gateway::BoxReading box;
  box.utc_ms = base::utc_ms();
  box.uptime_s = uptime_s(parts);
  box.overruns = runner.overruns;
  box.wake_up_worst_us = microseconds(runner.wake_up.worst_ns);
  box.wake_up_p99_us = microseconds(runner.wake_up.quantile_ns(0.99));
  box.config_hash = parts.reloader.config_hash();
  box.model_hash = parts.origin.model_hash;
  box.real_time_rights = parts.loops.rights_missing().empty();
  box.any_simulated = std::any_of(loops.begin(), loops.end(), [](const LoopRuntime& loop) {
    return is_simulated(loop.config);
  });
  box.journal_trouble = !lines.error.empty();
  box.journal_waiting = lines.waiting;
  box.journal_lost = lines.lost;
  box.window_backlog = watched.backlog;
  box.monitor_dropped = watched.dropped;
  box.box_alarms = parts.box_alarms.alarms().active();
  return box;
}

}  // namespace loopwarden::daemon
