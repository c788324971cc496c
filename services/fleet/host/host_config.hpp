// SPDX-License-Identifier: Apache-2.0
// Reads fleet.yaml, the settings of a host process. Broker, database and groups may be given on the
// command line instead.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "services/database/database_settings.hpp"
#include "services/net/sparkplug/edge_tracker.hpp"
#include "services/fleet/host/maintenance.hpp"
#include "services/fleet/host/writer.hpp"
#include "services/net/mqtt/client.hpp"

namespace loopwarden::fleet {

struct MetricsServer {
  std::string address = "127.0.0.1";
  std::uint16_t port = 9470;  // 0: no metrics endpoint
};

struct HostConfig {
  std::optional<mqtt::BrokerUrl> broker;
  std::string user;
  base::Secret password;
  std::string ca_file;
  std::string certificate_file;
  base::Secret key;
  DatabaseSettings database;
  std::vector<std::string> groups;  // empty: all groups, served as one
  std::string host_id = "loopwarden";
  std::filesystem::path state_directory = "/var/lib/loopwarden-fleet";
  std::uint64_t spool_bytes = 1024ULL * 1024ULL * 1024ULL;  // per group
  Retention retention;
  sparkplug::TrackerSettings tracker;
  WriterSettings writer;
  MetricsServer metrics;
  std::string log_level = "info";
};

// Options of the command line. They override the file.
struct CommandLine {
  std::string config_file;  // empty: no file
  std::string broker;
  std::string database;
  std::vector<std::string> groups;
};

config::Loaded<HostConfig> read_host_config(const CommandLine& command_line);
// Reads the same from the text of a file.
config::Loaded<HostConfig> read_host_text(const std::string& file, std::string_view text);

// Returns the identifier of the host application that serves a group. The group's edges name it as
// their primary host. "" means all groups.
std::string host_id_of(const HostConfig& config, const std::string& group);

}  // namespace loopwarden::fleet
