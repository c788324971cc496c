// SPDX-License-Identifier: Apache-2.0
#include "services/feed/feed_config.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "config/file_keys.hpp"
#include "config/log_level.hpp"
#include "config/document.hpp"
#include "services/net/broker/broker_reader.hpp"

namespace loopwarden::feed {
namespace {

using config::between;
using config::Choice;
using config::MapReader;
using config::Value;

constexpr std::array kTimeForms{Choice<TimeForm>{"s", TimeForm::s},
                                Choice<TimeForm>{"ms", TimeForm::ms},
                                Choice<TimeForm>{"iso", TimeForm::iso}};
constexpr std::array kQualityCodes{Choice<QualityCodes>{"opc", QualityCodes::opc},
                                   Choice<QualityCodes>{"opc_ua", QualityCodes::opc_ua}};

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(seconds * 1000.0));
}

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "box";
}

std::string read_name(MapReader& in, std::set<std::string>& names) {
  const Value<std::string> name =
      in.need_text("name", "name of the value, after the feeder's in a loop's file: FEEDER:NAME");
  if (!name.given || !name.valid) return {};
  if (!names.insert(name.value).second) {
    in.error("name", fmt::format("'{}' occurs twice", config::quotable(name.value)));
  }
  return name.value;
}

std::optional<JsonPointer> read_pointer(MapReader& in, const char* key, const char* meaning) {
  const Value<std::string> text = in.text(key, meaning, "");
  if (!text.given || !text.valid) return std::nullopt;
  try {
    return JsonPointer(text.value);
  } catch (const nlohmann::json::exception&) {
    in.error(key,
             fmt::format("must be a JSON Pointer (RFC 6901) such as /examples/0/value (got '{}')",
                         config::quotable(text.value)));
    return std::nullopt;
  }
}

void check_topic(MapReader& in, const Value<std::string>& topic) {
  if (!topic.given || !topic.valid) return;
  if (topic.value.find_first_of("+#") != std::string::npos) {
    in.error("topic", "must be one topic, without + and #");
  } else if (topic.value.starts_with("spBv1.0/")) {
    in.error("topic", "is one of Sparkplug: name its metrics in `metrics`");
  }
}

PayloadRule read_payload(MapReader& in) {
  PayloadRule rule;
  rule.value = read_pointer(in, "value",
                            "JSON Pointer to the value; absent: the payload itself is a number");
  rule.words =
      in.flag("words", "a text is a value, for the `mode` of a loop's file: AUTO, MAN", false);
  rule.time = read_pointer(in, "time", "JSON Pointer to the source's time; absent: no time");
  rule.time_form = in.one_of("time_form", kTimeForms,
                             "s or ms since 1970, or ISO 8601 with Z or an offset", TimeForm::s);
  rule.quality = read_pointer(in, "quality", "JSON Pointer to the quality; absent: always good");
  rule.quality_codes = in.one_of("quality_codes", kQualityCodes,
                                 "where quality is a number: opc, 192 is good; opc_ua, 0 is good",
                                 QualityCodes::opc);
  if ((rule.time || rule.quality) && !rule.value) in.error("`time` and `quality` need `value`");
  return rule;
}

TopicRule read_topic(MapReader& in, std::set<std::string>& names) {
  TopicRule rule;
  rule.name = read_name(in, names);
  const Value<std::string> topic = in.need_text("topic", "of MQTT, without + and #");
  check_topic(in, topic);
  rule.topic = topic.value;
  rule.payload = read_payload(in);
  rule.retained = in.flag(
      "retained", "a retained message counts, though it has no time and its age is not known",
      rule.retained);
  rule.timeout_ms =
      milliseconds(in.number("timeout",
                             {"s", between(0.0, 86'400.0),
                              "without a message for so long the value is bad; 0: a publisher that "
                              "has died is not seen"},
                             0.0))
          .count();
  return rule;
}

MetricRule read_metric(MapReader& in, std::set<std::string>& names) {
  MetricRule rule;
  rule.name = read_name(in, names);
  const Value<std::string> group = in.need_text("group", "Sparkplug group");
  const Value<std::string> edge = in.need_text("edge", "edge node");
  const Value<std::string> device = in.text("device", "empty: of the edge node itself", "");
  broker::check_identifier(in, "group", group);
  broker::check_identifier(in, "edge", edge);
  if (!device.value.empty()) broker::check_identifier(in, "device", device);
  rule.metric = in.need_text("metric", "its name, as the birth has it").value;
  rule.timeout_ms =
      milliseconds(in.number("timeout",
                             {"s", between(0.0, 86'400.0),
                              "without a message of the edge node for so long the value is bad; 0: "
                              "an edge node that is silent without a death is not seen"},
                             static_cast<double>(rule.timeout_ms) * 1e-3))
          .count();
  rule.group = group.value;
  rule.edge = edge.value;
  rule.device = device.value;
  return rule;
}

FeedConfig read_feed(MapReader& in, const std::string& file, Values values) {
  FeedConfig config;
  if (auto broker = in.need_section("broker", "MQTT broker")) {
    broker::read_broker(*broker, file, "loopwarden-feed-HOSTNAME", config.mqtt);
  }
  config.runtime_directory =
      config::read_path(in, "runtime_directory", "of loopwardend, where feed.sock is", file,
                        config.runtime_directory.string());
  config.feeder = in.text("feeder",
                          "name of this feeder in loopwardend.yaml; required if another feeder "
                          "there has the same user",
                          "");
  config.alive_interval = milliseconds(
      in.number("alive_interval",
                {"s", between(0.1, 60.0),
                 "between two lines to feed.sock while the broker is there; a third of the "
                 "shortest max_age of the loops, or shorter"},
                1.0));
  std::set<std::string> names;
  for (MapReader& one : in.maybe_list("topics", "values of plain topics")) {
    config.topics.push_back(read_topic(one, names));
  }
  for (MapReader& one : in.maybe_list("metrics", "values of Sparkplug B edge nodes")) {
    config.metrics.push_back(read_metric(one, names));
  }
  if (values == Values::needed && !in.describing() && !in.given("topics") && !in.given("metrics")) {
    in.error("needs `topics` or `metrics`");
  }
  config.ask_rebirth = in.flag(
      "ask_rebirth",
      "edge nodes whose birth was missed are asked for it: an NCMD, the one thing that is ever "
      "written to the broker",
      config.ask_rebirth);
  config.log_level = config::read_log_level(in);
  if (config.mqtt.client_id.empty()) config.mqtt.client_id = "loopwarden-feed-" + host_name();
  return config;
}

}  // namespace

config::Loaded<FeedConfig> read_feed_text(const std::string& file, std::string_view text,
                                          Values values) {
  return config::load_text<FeedConfig>(file, text,
                                       [&](MapReader& in) { return read_feed(in, file, values); });
}

config::Loaded<FeedConfig> read_feed_file(const std::filesystem::path& path, Values values) {
  return config::load_file(path, [&](const std::string& file, std::string_view text) {
    return read_feed_text(file, text, values);
  });
}

config::KeyReference describe_feed() {
  return config::keys_of([](MapReader& in) { read_feed(in, "feed.yaml", Values::needed); });
}

}  // namespace loopwarden::feed
