// SPDX-License-Identifier: Apache-2.0
#include "services/edge/edge_config.hpp"

#include <fmt/format.h>

#include <cmath>

#include "config/file_keys.hpp"
#include "config/log_level.hpp"
#include "config/document.hpp"
#include "services/net/sparkplug/topic.hpp"
#include "services/net/broker/broker_reader.hpp"

namespace loopwarden::edge {
namespace {

using broker::check_identifier;
using config::between;
using config::MapReader;

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(seconds * 1000.0));
}

void read_names(MapReader in, EdgeConfig& config) {
  const config::Value<std::string> group =
      in.need_text("group", "Sparkplug group, such as the plant");
  const config::Value<std::string> edge =
      in.need_text("edge",
                   "name of this box, unique in the group: two boxes "
                   "with one name disconnect each other from the broker");
  const config::Value<std::string> host = in.text(
      "primary_host", "host application; data is stored while it is offline; empty: not used", "");
  check_identifier(in, "group", group);
  check_identifier(in, "edge", edge);
  check_identifier(in, "primary_host", host);
  if (group.valid && group.value == "STATE") in.error("group", "STATE is the topic of hosts");
  config.group = group;
  config.edge = edge;
  config.primary_host = host;
}

void read_data(MapReader in, EdgeConfig& config) {
  config.interval = milliseconds(in.number(
      "interval",
      {"s", between(0.2, 60.0),
       "time between two readings of the daemon; a loop sends at most one message per reading"},
      1.0));
  config.slow_interval = milliseconds(in.number(
      "slow_interval",
      {"s", between(1.0, 86'400.0), "interval for counters and clocks, which change all the time"},
      60.0));
  config.dead_bands.percent =
      in.number("dead_band",
                {"%", between(0.0, 50.0),
                 "dead band, % of a metric's range, or of its last value if it has no "
                 "range; smaller changes are not sent"},
                config.dead_bands.percent);
  for (MapReader& one : in.maybe_list("dead_bands", "dead bands of single metrics")) {
    const config::Value<std::string> metric =
        one.need_text("metric", "name of the metric, such as pv");
    const config::Value<double> percent =
        one.need_number("percent", {"%", between(0.0, 50.0), "as dead_band"});
    if (!metric.valid || !percent.valid || one.describing()) continue;
    if (!config.dead_bands.by_metric.emplace(metric.value, percent.value).second) {
      one.error("metric", fmt::format("'{}' occurs twice", config::quotable(metric.value)));
    }
  }
}

void read_store(MapReader in, const std::string& file, EdgeConfig& config) {
  config.state_directory = config::read_path(
      in, "directory", "folder of store.sqlite with the reports that wait for broker or host", file,
      config.state_directory.string());
  config.most_stored_bytes =
      1024UL * 1024UL *
      static_cast<std::uint64_t>(in.integer("most_megabytes",
                                            {1, 1'000'000, "MiB",
                                             "limit of the store; beyond it the oldest reports are "
                                             "dropped and counted in store/dropped"},
                                            256));
  const config::Value<double> window =
      in.number("resend_window",
                {"s", between(5.0, 3600.0),
                 "after a loss of broker or host, reports of this time before it are "
                 "sent again, because they may not have arrived; at "
                 "least twice keep_alive"},
                60.0);
  config.resend_window = milliseconds(window);
  if (window.valid && config.resend_window < 2 * config.mqtt.keep_alive) {
    in.error("resend_window", fmt::format("must be at least twice keep_alive, {} s",
                                          2 * config.mqtt.keep_alive.count()));
  }
  config.replay_per_second = static_cast<std::size_t>(
      in.integer("replay_per_second",
                 {1, 10'000, "1/s", "rate of stored messages after broker and host have returned"},
                 static_cast<std::int64_t>(config.replay_per_second)));
}

void read_files(MapReader in, EdgeConfig& config) {
  config.most_file_bytes =
      1024UL * 1024UL *
      static_cast<std::uint64_t>(in.integer(
          "most_megabytes", {1, 1024, "MiB", "largest file that is sent on request"}, 16));
  config.file_part_bytes =
      1024UL * static_cast<std::size_t>(
                   in.integer("part_kilobytes", {1, 1024, "KiB", "size of each message"}, 64));
}

EdgeConfig read_edge(MapReader& in, const std::string& file) {
  EdgeConfig config;
  if (auto broker = in.need_section("broker", "MQTT broker")) {
    broker::read_broker(*broker, file, "loopwarden-GROUP-EDGE", config.mqtt);
  }
  if (auto names = in.need_section("sparkplug", "names by which hosts know this box"))
    read_names(*names, config);
  config.runtime_directory = config::read_path(
      in, "runtime_directory", "runtime directory of loopwardend, which contains its sockets", file,
      config.runtime_directory.string());
  if (auto data = in.maybe_section("data", "content and times of reports"))
    read_data(*data, config);
  if (auto store = in.maybe_section("store", "store and forward")) read_store(*store, file, config);
  if (auto files = in.maybe_section("files", "evidence and reports on request"))
    read_files(*files, config);
  config.orders = in.flag(
      "orders", "hosts may send commands, as far as loopwardend.yaml permits in its section edge",
      config.orders);
  config.commissions = config::read_path(
      in, "commissions", "folder with TAG/commission.json, for detectable/NAME; empty: not used",
      file);
  config.log_level = config::read_log_level(in);
  if (config.mqtt.client_id.empty()) {
    config.mqtt.client_id = fmt::format("loopwarden-{}-{}", config.group, config.edge);
  }
  return config;
}

}  // namespace

config::Loaded<EdgeConfig> read_edge_text(const std::string& file, std::string_view text) {
  return config::load_text<EdgeConfig>(file, text,
                                       [&](MapReader& in) { return read_edge(in, file); });
}

config::Loaded<EdgeConfig> read_edge_file(const std::filesystem::path& path) {
  return config::load_file(path, read_edge_text);
}

config::KeyReference describe_edge() {
  return config::keys_of([](MapReader& in) { read_edge(in, "edge.yaml"); });
}

}  // namespace loopwarden::edge
