// SPDX-License-Identifier: Apache-2.0
#include "services/edge/edge_config.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace edge_config_test {

using namespace std::chrono_literals;
using loopwarden::config::to_text;
using loopwarden::edge::EdgeConfig;
using loopwarden::edge::read_edge_text;

constexpr const char* kLeast =
    "broker: {url: 'mqtt://broker'}\nsparkplug: {group: plant, edge: box7}\n";

// Returns the errors of a refused configuration text.
std::string complaints(const std::string& text) {
  const auto loaded = read_edge_text("edge.yaml", text);
  CHECK_FALSE(loaded);
  return to_text(loaded.diagnostics);
}

TEST_CASE("the smallest configuration has a broker and two names", "[edge]") {
  const auto loaded = read_edge_text("edge.yaml", kLeast);
  REQUIRE(loaded);
  CHECK(loaded->mqtt.broker.host == "broker");
  CHECK(loaded->mqtt.client_id == "loopwarden-plant-box7");
  CHECK(loaded->primary_host.empty());
  CHECK_FALSE(loaded->orders);
  CHECK(loaded->interval == 1s);
  CHECK(loaded->resend_window == 60s);
}

TEST_CASE("every key is accepted", "[edge]") {
  const auto loaded = read_edge_text("/etc/loopwarden-edge/edge.yaml", R"(
broker:
  url: mqtts://broker:8884
  client_id: seven
  user: box7
  password: {credential: mqtt}
  ca_file: ca.pem
  certificate_file: /certs/box7.pem
  key: {file: box7.key}
  keep_alive: 20
  reconnect_min: 2
  reconnect_max: 30
sparkplug: {group: plant, edge: box7, primary_host: scada}
runtime_directory: /run/other
data:
  interval: 0.5
  slow_interval: 30
  dead_band: 1
  dead_bands:
    - {metric: pv, percent: 0.1}
store: {directory: /data, most_megabytes: 2, resend_window: 40, replay_per_second: 7}
files: {most_megabytes: 3, part_kilobytes: 16}
orders: true
commissions: /commissions
log_level: debug
)");
  REQUIRE(loaded);
  const EdgeConfig& c = *loaded;
  CHECK(c.mqtt.broker.port == 8884);
  CHECK(c.mqtt.client_id == "seven");
  CHECK(c.mqtt.password.credential == "mqtt");
  CHECK(c.mqtt.ca_file == "/etc/loopwarden-edge/ca.pem");
  CHECK(c.mqtt.certificate_file == "/certs/box7.pem");
  CHECK(c.mqtt.key.file == "/etc/loopwarden-edge/box7.key");
  CHECK(c.mqtt.keep_alive == 20s);
  CHECK(c.mqtt.reconnect_min == 2s);
  CHECK(c.mqtt.reconnect_max == 30s);
  CHECK(c.primary_host == "scada");
  CHECK(c.runtime_directory == "/run/other");
  CHECK(c.interval == 500ms);
  CHECK(c.slow_interval == 30s);
  CHECK(c.dead_bands.percent == 1.0);
  CHECK(c.dead_bands.by_metric.at("pv") == 0.1);
  CHECK(c.state_directory == "/data");
  CHECK(c.most_stored_bytes == 2UL * 1024 * 1024);
  CHECK(c.resend_window == 40s);
  CHECK(c.replay_per_second == 7);
  CHECK(c.most_file_bytes == 3UL * 1024 * 1024);
  CHECK(c.file_part_bytes == 16UL * 1024);
  CHECK(c.orders);
  CHECK(c.commissions == "/commissions");
  CHECK(c.log_level == "debug");
}

TEST_CASE("errors are reported with their place", "[edge]") {
  CHECK_THAT(complaints("sparkplug: {group: a, edge: b}\n"), Catch::Contains("broker"));
  CHECK_THAT(complaints(std::string(kLeast) + "order: true\n"),
             Catch::Contains("edge.yaml:3:1") && Catch::Contains("did you mean 'orders'"));
  CHECK_THAT(complaints("broker: {url: broker}\nsparkplug: {group: a, edge: b}\n"),
             Catch::Contains("edge.yaml:1:15") && Catch::Contains("mqtts://"));
  CHECK_THAT(complaints("broker: {url: 'mqtt://b'}\nsparkplug: {group: a/b, edge: b}\n"),
             Catch::Contains("sparkplug.group") && Catch::Contains("without / + #"));
  CHECK_THAT(complaints("broker: {url: 'mqtt://b'}\nsparkplug: {group: STATE, edge: b}\n"),
             Catch::Contains("topic of hosts"));
  CHECK_THAT(
      complaints(
          "broker: {url: 'mqtt://b', password: {credential: p}}\nsparkplug: {group: a, edge: b}\n"),
      Catch::Contains("needs user"));
  CHECK_THAT(
      complaints(
          "broker: {url: 'mqtt://b', user: u, password: {}}\nsparkplug: {group: a, edge: b}\n"),
      Catch::Contains("either `credential` or `file`"));
  CHECK_THAT(complaints("broker: {url: 'mqtt://b', user: u, password: {credential: a/b}}\n"
                        "sparkplug: {group: a, edge: b}\n"),
             Catch::Contains("without '/'"));
  CHECK_THAT(
      complaints(
          "broker: {url: 'mqtts://b', certificate_file: c}\nsparkplug: {group: a, edge: b}\n"),
      Catch::Contains("belong together. Give"));
  CHECK_THAT(complaints("broker: {url: 'mqtt://b', ca_file: c}\nsparkplug: {group: a, edge: b}\n"),
             Catch::Contains("need TLS"));
  CHECK_THAT(complaints(std::string(kLeast) + "store: {resend_window: 20}\n"),
             Catch::Contains("twice keep_alive"));
  CHECK_THAT(complaints(std::string(kLeast) +
                        "data: {dead_bands: [{metric: a, percent: 1}, {metric: a, percent: 2}]}\n"),
             Catch::Contains("twice"));
  CHECK_THAT(complaints("broker: {url: 'mqtt://b', reconnect_min: 9, reconnect_max: 3}\nsparkplug: "
                        "{group: a, edge: b}\n"),
             Catch::Contains("at least reconnect_min"));
  CHECK_THAT(complaints("[]"), Catch::Contains("edge.yaml:1:1"));
}

TEST_CASE("docs/reference/edge-keys.md matches the description by the reader",
          "[edge][reference]") {
  const std::string path = LOOPWARDEN_SOURCE_DIR "/docs/reference/edge-keys.md";
  const std::string described =
      "# Keys of edge.yaml\n\n"
      "<!-- Generated from services/edge; tests_fleet \"[reference]\" shows how to renew it. "
      "-->\n\n"
      "Guide: [publish-to-sparkplug.md](../how-to/publish-to-sparkplug.md). Unknown keys are "
      "errors with their place.\n" +
      loopwarden::config::to_markdown(loopwarden::edge::describe_edge());
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    loopwarden::tests::write_file(path, described);
  }
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_fleet '[reference]'");
  CHECK((loopwarden::tests::read_file(path) == described));
}

}  // namespace edge_config_test
