// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/status.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/clock.hpp"
#include "daemon/app/assemble.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon {

using nlohmann::json;

namespace {

double microseconds(std::int64_t ns) { return static_cast<double>(ns) / 1000.0; }

double uptime_s(const Assembly& parts) {
  return static_cast<double>(base::MonotonicClock().now_ns() - parts.origin.started_ns) / 1e9;
}

json histogram_json(const rt::LatencyHistogram& h) {
  return {{"p50", microseconds(h.quantile_ns(0.5))},
          {"p99", microseconds(h.quantile_ns(0.99))},
          {"p99_9", microseconds(h.quantile_ns(0.999))},
          {"worst", microseconds(h.worst_ns)},
          {"sum", microseconds(h.sum_ns)},
          {"bins", h.bins}};
}

json journal_json(const journal::Journal& journal) {
  const journal::JournalStatus lines = journal.status();
  return {{"file", journal.path().string()}, {"written", lines.written},
          {"waiting", lines.waiting},        {"lost", lines.lost},
          {"damaged", lines.damaged},        {"error", lines.error}};
}

json evidence_json(const EvidenceStatus& kept) {
  return {{"written", kept.written},
          {"waiting", kept.waiting},
          {"lost", kept.lost},
          {"error", kept.error},
          {"removal_error", kept.removal_error}};
}

json explanations_json(const ExplainerStatus& explained) {
  return {{"explained", explained.explained},
          {"failed", explained.failed},
          {"waiting", explained.waiting}};
}

json monitor_json(const monitor::MonitorStatus& watched) {
  return {{"windows", watched.windows},
          {"cycles", watched.cycles},
          {"dropped", watched.dropped},
          {"backlog", watched.backlog}};
}

json modbus_json(const gateway::Gateway& gateway) {
  const gateway::TcpServerCounters c = gateway.counters();
  json server = {{"port", gateway.port()},  {"clients", c.clients}, {"requests", c.requests},
                 {"accepted", c.accepted},  {"refused", c.refused}, {"displaced", c.displaced},
                 {"malformed", c.malformed}};
  if (const auto serial = gateway.serial_counters()) {
    server["serial"] = {
        {"open", serial->open}, {"requests", serial->requests}, {"malformed", serial->malformed}};
  }
  return server;
}

json rights_json(const config::SocketRights& rights) {
  return {{"alarms", rights.alarms}, {"control", rights.control}};
}

}  // namespace

json status_of(const Assembly& parts) {
  const rt::RunnerStatus runner = parts.loops.status();
  return {{"version", LOOPWARDEN_VERSION},
          {"config_hash", parts.reloader.config_hash()},
          {"configuration", parts.reloader.status()},
          {"recorder", {{"disk_wait_s", parts.historian.recorder().disk_wait_s()}}},
          {"log_lines_lost", parts.origin.log_lines_lost ? parts.origin.log_lines_lost() : 0},
          {"model_hash", parts.origin.model_hash},
          {"journal", journal_json(parts.journal)},
          {"evidence", evidence_json(parts.evidence.store().status())},
          {"explanations", explanations_json(parts.evidence.explainer().status())},
          {"monitor", monitor_json(parts.watching.monitor->status())},
          {"modbus_server", parts.modbus ? modbus_json(parts.modbus->gateway) : json(nullptr)},
          {"uptime_s", uptime_s(parts)},
          {"accelerate", parts.configuration.daemon.accelerate},
          {"real_time_missing", parts.loops.rights_missing()},
          {"ticks", runner.ticks},
          {"overruns", runner.overruns},
          {"skipped_ticks", runner.skipped_ticks},
          {"events_dropped", parts.loops.events_dropped()},
          {"wake_up_us", histogram_json(runner.wake_up)},
          {"work_us", histogram_json(runner.work)}};
}

json description_of(const Assembly& parts) {
  const console::Rights rights = parts.control.rights();
  const config::DaemonConfig& config = parts.configuration.daemon;
  return {{"version", LOOPWARDEN_VERSION},
          {"config_hash", parts.reloader.config_hash()},
          {"model_hash", parts.origin.model_hash},
          {"accelerate", config.accelerate},
          {"started_ms", parts.origin.started_ms},
          {"state_directory", config.state_directory},
          {"page", rights_json(rights.page)},
          {"edge", rights_json(rights.edge)},
          {"alarms",
           {{"severe_percent", config.alarms.severe_percent},
            {"latching", config.alarms.settings.latching},
            {"shelve_limit_min", config.alarms.settings.shelve_limit_ms / 60'000}}}};
}

gateway::BoxReading box_reading_of(const Assembly& parts) {
  const rt::RunnerStatus runner = parts.loops.status();
  const journal::JournalStatus lines = parts.journal.status();
  const monitor::MonitorStatus watched = parts.watching.monitor->status();
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
  return box;
}

}  // namespace loopwarden::daemon
