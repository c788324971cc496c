// SPDX-License-Identifier: Apache-2.0
#include "config/log_level.hpp"
#include "config/daemon_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "base/device_name.hpp"
#include "base/group_access.hpp"
#include "base/local_address.hpp"
#include "base/peer_list.hpp"
#include "config/modbus_server_reader.hpp"
#include "config/serial_line_reader.hpp"
#include "config/source_file.hpp"

namespace loopwarden::config {
namespace {

using hal::modbus::LinkSettings;
using hal::modbus::Transport;

constexpr auto kTransports =
    std::to_array<Choice<Transport>>({{"tcp", Transport::tcp}, {"rtu", Transport::rtu}});

int milliseconds(double seconds) { return static_cast<int>(std::lround(seconds * 1000.0)); }

void read_tcp(MapReader in, LinkSettings& link) {
  const Value<std::string> host =
      in.need_text("host",
                   "numeric IPv4 or IPv6 address, or localhost: names are not resolved, because a "
                   "silent name server would block the link");
  link.host = host;
  if (host.given && host.valid && host.value != "localhost" && !base::is_address(host)) {
    in.error("host", fmt::format("must be a numeric address or localhost (got '{}')",
                                 quotable(host.value)));
  }
  in.set_integer("port", {1, 65535, "", "TCP port"}, link.port);
  link.connect_timeout_ms = milliseconds(
      in.number("connect_timeout", {"s", between(0.05, 10.0), "for a connection"}, 1.0));
  const Value<std::int64_t> connections = in.maybe_integer(
      "connections", {1, 4, "", "shared by the units of a gateway", false, "one a unit"});
  if (connections.given) link.connections = static_cast<int>(connections);
}

void read_rtu(MapReader in, LinkSettings& link) { read_serial_line(in, link); }

// `addressed`: set if the keys that locate the device have no error, even if others have.
LinkSettings read_link(MapReader& in, const std::string& name, bool& addressed) {
  LinkSettings link;
  link.name = name;
  const Value<Transport> transport =
      in.need_one_of("transport", kTransports, "Modbus TCP or Modbus RTU on a serial line");
  link.transport = transport;
  const Value<double> response_timeout =
      in.maybe_number("response_timeout", {"s", between(0.01, 10.0),
                                           "from the end of a request to the end of its reply",
                                           "0.3 s (tcp), 0.5 s (rtu)"});
  if (response_timeout.given) link.response_timeout_ms = milliseconds(response_timeout);
  link.pause_ms = milliseconds(
      in.number("pause",
                {"s", between(0.0, 1.0),
                 "silence between a reply and the next request; rtu adds 3.5 characters"},
                0.0));
  const Value<double> shortest_wait = in.number(
      "reconnect_min", {"s", between(0.05, 60.0), "first wait before a new attempt; it doubles"},
      link.reconnect_min_s);
  const Value<double> longest_wait =
      in.number("reconnect_max", {"s", between(0.05, 600.0), "longest wait before a new attempt"},
                link.reconnect_max_s);
  link.reconnect_min_s = shortest_wait;
  link.reconnect_max_s = longest_wait;
  if (shortest_wait.valid && longest_wait.valid && shortest_wait > longest_wait) {
    in.error("reconnect_max",
             fmt::format("must be at least reconnect_min = {} s (at {}) (got {})",
                         brief(shortest_wait), to_text(shortest_wait.place), brief(longest_wait)));
  }
  in.set_number("probe_interval",
                {"s", between(0.5, 600.0),
                 "interval of requests to a unit that does not answer, if others share its line or "
                 "connection; each request delays these by response_timeout"},
                link.probe_interval_s);
  if (!transport.valid) in.ignore_rest();
  const bool known = in.describing() || transport.valid;
  const std::size_t errors = in.report().error_count();
  if (in.describing() || (known && transport == Transport::tcp)) read_tcp(in.variant("tcp"), link);
  if (in.describing() || (known && transport == Transport::rtu)) read_rtu(in.variant("rtu"), link);
  in.close();  // an unknown key may be a misspelt port
  addressed = transport.given && transport.valid && in.report().error_count() == errors;
  return link;
}

// Two links on one serial line, or a link and a slave, would disturb each other.
void refuse_shared_device(MapReader& in, const DaemonFile& daemon, const LinkSettings& link) {
  if (link.transport != Transport::rtu || link.device.empty()) return;
  const std::string device = base::device_name(link.device);
  const auto& server = daemon.config.modbus_server;
  if (server && server->serial && base::device_name(server->serial->line.device) == device) {
    in.error("device",
             fmt::format("{} is the device of modbus_server.serial as well; a line has one "
                         "master, or this is one of its slaves",
                         quotable(link.device)));
  }
  for (const auto& [name, other] : daemon.config.links) {
    if (other.transport == Transport::rtu && base::device_name(other.device) == device) {
      in.error("device", fmt::format("{} is the device of link '{}' (at {}) as well; use one link "
                                     "for both",
                                     quotable(link.device), quotable(name),
                                     to_text(daemon.links.at(name).place)));
    }
  }
}

void read_real_time(MapReader& in, RealTime& real_time) {
  in.set_integer("priority",
                 {0, 98, "", "SCHED_FIFO priority of the loop thread; 0: ordinary scheduling"},
                 real_time.priority);
  const Value<std::int64_t> cpu =
      in.maybe_integer("cpu", {0, 1023, "", "CPU for the loop thread", false, "any"});
  if (cpu.given) real_time.cpu = static_cast<int>(cpu.value);
  real_time.lock_memory = in.flag("lock_memory", "keep all memory in RAM (mlockall)", true);
}

// Reads a user of this host, by name.
FeederUser read_feeder(MapReader& in) {
  FeederUser feeder;
  const Value<std::string> user = in.need_text(
      "user",
      "user whose processes may write this feeder's values to feed.sock. Feeders of one "
      "user each need `feeder` in feed.yaml or opcua.yaml");
  feeder.user = user;
  if (!user.given || !user.valid) return feeder;
  feeder.uid = base::user_id(user);
  if (!feeder.uid && !in.describing()) {
    in.warning("user",
               fmt::format("there is no user '{}' on this host, so this feeder can't write values",
                           quotable(user.value)));
  }
  return feeder;
}

RecordingOfAll read_recording(MapReader& in) {
  RecordingOfAll recording;
  const Value<double> sync = in.maybe_number(
      "sync", {"s", between(0.0, 3600.0),
               "between two writes to the disk: longest loss of rows after a power failure",
               "60 s on flash memory (SD card, eMMC, SSD), otherwise 5 s"});
  if (sync.given) recording.sync_s = sync;
  const Value<double> budget = in.maybe_number(
      "write_budget_mb", {"MB", between(1.0, 1e7),
                          "written per day by the daemon; above it the alarm disk_writes is raised",
                          "4 times the rows, and 100 MB, on flash memory; otherwise no limit"});
  if (budget.given) recording.write_budget_mb = budget;
  return recording;
}

SocketRights read_rights(MapReader& in) {
  SocketRights rights;
  rights.alarms = in.flag(
      "alarms",
      "acknowledge, reset and shelve alarms, veto corrective action, start offered planned moves",
      false);
  rights.control = in.flag("control", "set point, mode, output and jacket", false);
  return rights;
}

// The kernel limits the length of socket paths, which includes this folder.
void check_runtime_directory(MapReader& in, const Value<std::string>& directory,
                             const std::string& resolved) {
  if (in.describing() || !directory.valid) return;
  std::error_code error;
  const std::filesystem::file_status there = std::filesystem::status(resolved, error);
  if (std::filesystem::exists(there) && !std::filesystem::is_directory(there)) {
    in.error("runtime_directory",
             fmt::format("must be a folder, or not exist yet (got {})", quotable(resolved)));
    return;
  }
  const std::string longest = (std::filesystem::path(resolved) / "control.sock").string();
  if (longest.size() <= base::kLongestSocketPath) return;
  in.error("runtime_directory",
           fmt::format("must be shorter: the path of a socket in it has at most {} bytes (got {})",
                       base::kLongestSocketPath, quotable(longest)));
}

}  // namespace

DaemonFile read_daemon(MapReader& in, const std::string& file) {
  DaemonFile daemon;
  DaemonConfig& config = daemon.config;
  config.file = file;
  in.maybe_section("real_time", "the loop thread's rights",
                   [&](MapReader& real_time) { read_real_time(real_time, config.real_time); });
  daemon.accelerate =
      in.number("accelerate",
                {"",
                 {.low = 0.0, .high = 10000.0, .low_is_open = true},
                 "times real time; other than 1 only if every loop is simulated or replayed"},
                config.accelerate);
  config.accelerate = daemon.accelerate;
  // operator/ keeps an absolute path as it is.
  const Value<std::string> runtime =
      in.text("runtime_directory", "for sockets and metrics; relative to this file",
              config.runtime_directory);
  config.runtime_directory = resolve(file, runtime);
  check_runtime_directory(in, runtime, config.runtime_directory);
  config.state_directory = resolve(
      file,
      in.text("state_directory", "for recordings; relative to this file", config.state_directory));
  config.log_level = read_log_level(in);
  in.set_number("stop_timeout",
                {"s", between(0.1, 60.0), "time to bring all outputs to their stop actions"},
                config.stop_timeout_s);
  in.maybe_section("modbus_server", "offers the register map to Modbus masters",
                   [&](MapReader& server) { config.modbus_server = read_modbus_server(server); });
  in.maybe_section("alarms", "of all loops",
                   [&](MapReader& alarms) { config.alarms = read_alarms(alarms); });
  in.maybe_section("recording", "of all loops to disk",
                   [&](MapReader& recording) { config.recording = read_recording(recording); });
  const Value<std::vector<std::string>> certificates =
      in.maybe_texts("certificates",
                     "PEM files that loopwardend can read; the alarm certificate_expires is raised "
                     "14 days before one expires",
                     "[PATH, ...]");
  for (const std::string& name : certificates.value) {
    config.certificates.push_back(resolve(file, name));
  }
  in.maybe_section(
      "page", "commands permitted to loopwarden-page; without this key it only reads",
      [&](MapReader& page) {
        config.page = read_rights(page);
        config.page.tuning = page.flag("tuning", "gains of loops that are controlled here", false);
        config.page.reports =
            page.flag("reports", "request reports on the recorded data of a loop", false);
        config.page.tests =
            page.flag("tests", "carry out proposed tests of loops that are controlled here", false);
      });
  in.maybe_section("edge", "commands permitted to loopwarden-edge; without this key it only reads",
                   [&](MapReader& edge) { config.edge = read_rights(edge); });
  for (auto& [name, section] : in.maybe_named_sections(
           "feeders", "name", "users who may send values of watched loops to feed.sock")) {
    if (name.find(':') != std::string::npos) section.error("a feeder's name has no ':'");
    config.feeders.emplace(name, read_feeder(section));
  }
  for (auto& [name, section] :
       in.maybe_named_sections("links", "name", "Modbus links that loops refer to by name")) {
    const std::size_t errors = in.report().error_count();
    LinkState state{.place = section.place()};
    LinkSettings link = read_link(section, name, state.addressed);
    refuse_shared_device(section, daemon, link);
    state.sound = in.report().error_count() == errors;
    daemon.link_errors += in.report().error_count() - errors;
    daemon.links.emplace(name, state);
    config.links.emplace(name, std::move(link));
  }
  return daemon;
}

}  // namespace loopwarden::config
