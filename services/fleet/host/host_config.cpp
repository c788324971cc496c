// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/host_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "config/file_keys.hpp"
#include "config/log_level.hpp"
#include "config/document.hpp"
#include "services/net/sparkplug/topic.hpp"
#include "base/peer_list.hpp"

namespace loopwarden::fleet {
namespace {

using config::Choice;
using config::MapReader;
using config::Report;
using config::Value;

constexpr std::uint64_t kMebibyte = 1024ULL * 1024ULL;
constexpr std::size_t kMostGroups = 100;
constexpr const char* kDatabasePassword = "database_password";

std::optional<std::string> broker_error(const std::string& text,
                                        std::optional<mqtt::BrokerUrl>& url) {
  try {
    url = mqtt::parse_broker_url(text);
    return std::nullopt;
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
}

std::optional<std::string> groups_error(const std::vector<std::string>& groups) {
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (!sparkplug::is_identifier(groups[i]) || groups[i] == "STATE") {
      return fmt::format("'{}' can't be a group's name", config::quotable(groups[i]));
    }
    if (std::find(groups.begin(), groups.begin() + static_cast<std::ptrdiff_t>(i), groups[i]) !=
        groups.begin() + static_cast<std::ptrdiff_t>(i)) {
      return fmt::format("has '{}' twice", config::quotable(groups[i]));
    }
  }
  if (groups.size() > kMostGroups) return fmt::format("has more than {} groups", kMostGroups);
  return std::nullopt;
}

void read_broker(MapReader& in, HostConfig& config, const std::string& file) {
  const Value<std::string> url = in.text("broker", "mqtt://HOST[:PORT] or mqtts://HOST[:PORT]", "");
  if (url.given && url.valid) {
    if (const auto error = broker_error(url.value, config.broker)) in.error("broker", *error);
  }
  config.user = in.text("user", "user at the broker; default: anonymous", "");
  config.password = config::read_secret_at(in, "password", "password of that user", file);
  if (std::optional<MapReader> tls = in.maybe_section("tls", "TLS settings for mqtts://")) {
    config.ca_file = config::read_path(
        *tls, "ca", "trusted certificates (PEM); default: those of the system", file);
    config.certificate_file =
        config::read_path(*tls, "certificate", "the host's certificate (PEM)", file);
    config.key = config::read_secret_at(*tls, "key", "key of that certificate (PEM)", file);
  }
}

void read_database(MapReader& in, HostConfig& config, const std::string& file) {
  config.database = read_database_settings(in, config::Presence::optional, kDatabasePassword, file);
  if (std::optional<MapReader> keep = in.maybe_section("keep", "retention of rows")) {
    const auto days = [&](const char* key, const char* meaning, int fallback) {
      return static_cast<int>(keep->integer(key, {1, 36'600, "days", meaning}, fallback));
    };
    Retention& retention = config.retention;
    retention.values_days = days("values", "all values", retention.values_days);
    retention.history_days =
        days("history", "quarters of an hour, alarms, explanations", retention.history_days);
    retention.evidence_days = days("evidence", "files of alarms", retention.evidence_days);
  }
}

void read_rest(MapReader& in, HostConfig& config, const std::string& file) {
  const Value<std::vector<std::string>> groups =
      in.maybe_texts("groups", "groups to serve; default: all, served as one");
  config.groups = groups.value;
  if (const auto error = groups_error(config.groups)) in.error("groups", *error);
  const Value<std::string> id = in.text(
      "host_id", "identifier of the host application: HOST_ID-GROUP, or HOST_ID for all groups",
      config.host_id);
  config.host_id = id;
  if (id.valid && !sparkplug::is_identifier(config.host_id)) {
    in.error("host_id", "must have no / + # and no control characters");
  }
  config.tracker.reorder_timeout_ms = static_cast<std::int64_t>(
      1e3 *
      in.number("reorder_timeout",
                {"s", config::between(0.0, 60.0),
                 "longest wait of a message for missing earlier ones; a rebirth is then requested"},
                static_cast<double>(config.tracker.reorder_timeout_ms) / 1e3));
  config.state_directory = config::read_path(in, "state_directory", "folder of the spool", file,
                                             config.state_directory.string());
  config.spool_bytes =
      kMebibyte *
      static_cast<std::uint64_t>(
          in.integer(
                "spool",
                {16, 1'000'000, "MiB",
                 "size of the spool on the disk per group, used while the database is unavailable"},
                static_cast<std::int64_t>(config.spool_bytes / kMebibyte))
              .value);
  if (std::optional<MapReader> evidence = in.maybe_section("evidence", "evidence of alarms")) {
    config.writer.ask_evidence =
        evidence->flag("ask", "request evidence from the box when an alarm is raised", true);
    config.writer.evidence_delay_s = static_cast<int>(
        evidence->integer("delay", {0, 86'400, "s", "delay from the alarm to the request"},
                          config.writer.evidence_delay_s));
  }
  if (std::optional<MapReader> metrics =
          in.maybe_section("metrics", "metrics for Prometheus over HTTP")) {
    const Value<std::string> address =
        metrics->text("address", "listening address, numeric", config.metrics.address);
    if (address.given && address.valid && !base::parse_network(address)) {
      metrics->error("address", fmt::format("must be a numeric address (got '{}')",
                                            config::quotable(address.value)));
    }
    config.metrics.address = address;
    config.metrics.port = static_cast<std::uint16_t>(
        metrics->integer("port", {0, 65'535, "", "0: none"}, config.metrics.port));
  }
  config.log_level = config::read_log_level(in);
}

void read_file(const std::string& file, std::string_view text, Report& report, HostConfig& config) {
  config::read_document(text, report, [&](MapReader& in) {
    read_broker(in, config, file);
    read_database(in, config, file);
    read_rest(in, config, file);
  });
}

// Reports an error of the command line, which has no position in a file.
void complain(Report& report, std::string_view option, const std::optional<std::string>& error) {
  if (error) report.error({}, option, *error);
}

}  // namespace

config::Loaded<HostConfig> read_host_text(const std::string& file, std::string_view text) {
  Report report(file);
  HostConfig config;
  read_file(file, text, report, config);
  return config::loaded(std::move(config), report);
}

config::Loaded<HostConfig> read_host_config(const CommandLine& command_line) {
  const bool has_file = !command_line.config_file.empty();
  Report report(has_file ? command_line.config_file : "command line");
  HostConfig config;
  if (has_file) {
    if (const auto text = config::read_source_file(command_line.config_file, report)) {
      read_file(command_line.config_file, *text, report, config);
    }
  }
  if (!command_line.broker.empty()) {
    complain(report, "--broker", broker_error(command_line.broker, config.broker));
  }
  if (!command_line.database.empty()) {
    config.database.url = command_line.database;
    complain(report, "--database", database_url_error(config.database.url, kDatabasePassword));
  }
  if (!command_line.groups.empty()) {
    config.groups = command_line.groups;
    complain(report, "--groups", groups_error(config.groups));
  }
  if (!report.has_errors() && !config.broker) {
    report.error({}, "broker", "must be given, here or as --broker");
  }
  if (!report.has_errors() && config.database.url.empty()) {
    report.error({}, "database", "must be given, here or as --database");
  }
  return config::loaded(std::move(config), report);
}

std::string host_id_of(const HostConfig& config, const std::string& group) {
  return group.empty() ? config.host_id : config.host_id + '-' + group;
}

}  // namespace loopwarden::fleet
