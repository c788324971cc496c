// SPDX-License-Identifier: Apache-2.0
// edge.yaml, the configuration of loopwarden-edge.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "services/net/mqtt/client.hpp"

namespace loopwarden::edge {

struct DeadBands {
  double percent = 0.5;  // of a metric's range, or of its last value if it has no range
  std::map<std::string, double> by_metric;  // percent, by the metric's name
};

struct EdgeConfig {
  mqtt::ClientSettings mqtt;
  std::string group;
  std::string edge;
  std::string primary_host;  // empty: births follow the connection
  std::filesystem::path runtime_directory = "/run/loopwardend";  // of the daemon: its sockets
  std::chrono::milliseconds interval{
      1000};  // between two readings of the daemon, so between two DDATA of a loop
  std::chrono::milliseconds slow_interval{
      60'000};  // of counters and clocks, which change all the time
  DeadBands dead_bands;
  bool orders = false;
  std::filesystem::path commissions;  // folder with TAG/commission.json; empty: not used
  std::filesystem::path state_directory = "/var/lib/loopwarden-edge";
  std::uint64_t most_stored_bytes = 256UL * 1024UL * 1024UL;
  std::chrono::milliseconds resend_window{60'000};
  std::size_t replay_per_second = 100;  // messages
  std::uint64_t most_file_bytes = 16UL * 1024UL * 1024UL;
  std::size_t file_part_bytes = 64UL * 1024UL;
  std::string log_level = "info";
};

config::Loaded<EdgeConfig> read_edge_file(const std::filesystem::path& path);
// `file`: name in diagnostics, and start of relative paths.
config::Loaded<EdgeConfig> read_edge_text(const std::string& file, std::string_view text);

config::KeyReference describe_edge();

}  // namespace loopwarden::edge
