// SPDX-License-Identifier: Apache-2.0
#include "services/feed/feed_config.hpp"

#include <catch2/catch.hpp>

#include <chrono>
#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace feed_config_test {

using namespace std::chrono_literals;
using namespace loopwarden::feed;
using loopwarden::config::to_text;

const std::string kBroker = "broker: {url: 'mqtt://b'}\n";

// Returns the errors of a refused configuration text.
std::string complaints(const std::string& text) {
  const auto loaded = read_feed_text("feed.yaml", text);
  CHECK_FALSE(loaded);
  return to_text(loaded.diagnostics);
}

TEST_CASE("the smallest feed.yaml has a broker and a value", "[feed]") {
  const auto loaded = read_feed_text("feed.yaml", kBroker + "topics: [{name: PV, topic: a/b}]\n");
  REQUIRE(loaded);
  CHECK(loaded->mqtt.broker.host == "b");
  CHECK_THAT(loaded->mqtt.client_id, Catch::StartsWith("loopwarden-feed-"));
  CHECK(loaded->alive_interval == 1s);
  CHECK(loaded->runtime_directory == "/run/loopwardend");
  CHECK_FALSE(loaded->ask_rebirth);
  REQUIRE(loaded->topics.size() == 1);
  const TopicRule& rule = loaded->topics[0];
  CHECK(rule.name == "PV");
  CHECK(rule.topic == "a/b");
  CHECK_FALSE(rule.payload.value);
  CHECK_FALSE(rule.retained);
  CHECK(rule.timeout_ms == 0);
}

TEST_CASE("every key of feed.yaml is accepted", "[feed]") {
  const auto loaded = read_feed_text("/etc/loopwarden-feed/feed.yaml", R"(
broker: {url: 'mqtts://b:8884', user: feed, password: {credential: p}, ca_file: ca.pem,
         client_id: seven}
runtime_directory: /run/other
alive_interval: 0.5
topics:
  - name: FIC205.PV
    topic: plant/fic205
    value: /d/0/pv
    time: /t
    time_form: ms
    quality: /q
    quality_codes: opc_ua
    retained: true
    timeout: 2.5
metrics:
  - {name: FIC206.PV, group: g, edge: e, device: d, metric: PID/PV}
  - {name: T, group: g, edge: e, metric: T}
ask_rebirth: true
log_level: debug
)");
  REQUIRE(loaded);
  CHECK(loaded->mqtt.client_id == "seven");
  CHECK(loaded->mqtt.ca_file == "/etc/loopwarden-feed/ca.pem");
  CHECK(loaded->runtime_directory == "/run/other");
  CHECK(loaded->alive_interval == 500ms);
  const TopicRule& rule = loaded->topics.at(0);
  CHECK(rule.payload.value == JsonPointer("/d/0/pv"));
  CHECK(rule.payload.time == JsonPointer("/t"));
  CHECK(rule.payload.time_form == TimeForm::ms);
  CHECK(rule.payload.quality == JsonPointer("/q"));
  CHECK(rule.payload.quality_codes == QualityCodes::opc_ua);
  CHECK(rule.retained);
  CHECK(rule.timeout_ms == 2500);
  const MetricRule& metric = loaded->metrics.at(0);
  CHECK(metric.timeout_ms == 300'000);
  CHECK(metric.name == "FIC206.PV");
  CHECK(metric.group == "g");
  CHECK(metric.edge == "e");
  CHECK(metric.device == "d");
  CHECK(metric.metric == "PID/PV");
  CHECK(loaded->metrics.at(1).device.empty());
  CHECK(loaded->ask_rebirth);
  CHECK(loaded->log_level == "debug");
}

TEST_CASE("errors of feed.yaml are reported with their place", "[feed]") {
  CHECK_THAT(complaints(kBroker), Catch::Contains("`topics` or `metrics`"));
  CHECK_THAT(complaints("topics: [{name: a, topic: b}]\n"), Catch::Contains("broker"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: b, valu: /c}]\n"),
             Catch::Contains("feed.yaml:2:") && Catch::Contains("did you mean 'value'"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: b}]\nmetrics: [{name: a, group: g, "
                                  "edge: e, metric: m}]\n"),
             Catch::Contains("feed.yaml:3:") && Catch::Contains("'a' occurs twice"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: b/+}]\n"),
             Catch::Contains("topics[0].topic") && Catch::Contains("without + and #"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: spBv1.0/g/DDATA/e/d}]\n"),
             Catch::Contains("`metrics`"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: b, value: pv}]\n"),
             Catch::Contains("JSON Pointer"));
  CHECK_THAT(complaints(kBroker + "topics: [{name: a, topic: b, time: /t}]\n"),
             Catch::Contains("need `value`"));
  CHECK_THAT(complaints(kBroker + "metrics: [{name: a, group: g/h, edge: e, metric: m}]\n"),
             Catch::Contains("metrics[0].group") && Catch::Contains("without / + #"));
  CHECK_THAT(
      complaints(kBroker + "metrics: [{name: a, group: g, edge: e, device: '#', metric: m}]\n"),
      Catch::Contains("metrics[0].device"));
}

TEST_CASE("the example is a valid configuration", "[feed]") {
  const auto loaded = read_feed_file(LOOPWARDEN_SOURCE_DIR "/examples/watch-mqtt/feed.yaml");
  CHECK(to_text(loaded.diagnostics).empty());
  REQUIRE(loaded);
  CHECK_FALSE(loaded->topics.empty());
  CHECK_FALSE(loaded->metrics.empty());
}

TEST_CASE("docs/reference/feed-keys.md matches the description by the reader",
          "[feed][reference]") {
  const std::string path = LOOPWARDEN_SOURCE_DIR "/docs/reference/feed-keys.md";
  const std::string described =
      "# Keys of feed.yaml\n\n"
      "<!-- Generated from services/feed; tests_fleet \"[reference]\" shows how to renew it. "
      "-->\n\n"
      "Guide: [watch-a-loop-by-mqtt.md](../how-to/watch-a-loop-by-mqtt.md). "
      "Unknown keys are errors with their place.\n" +
      loopwarden::config::to_markdown(describe_feed());
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    loopwarden::tests::write_file(path, described);
  }
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_fleet '[reference]'");
  CHECK((loopwarden::tests::read_file(path) == described));
}

}  // namespace feed_config_test
