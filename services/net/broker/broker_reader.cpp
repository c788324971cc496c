// SPDX-License-Identifier: Apache-2.0
#include "services/net/broker/broker_reader.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "config/file_keys.hpp"
#include "config/yaml_document.hpp"
#include "services/net/mqtt/broker_url.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::broker {
namespace {

using config::between;
using config::MapReader;
using config::quotable;
using config::read_path;
using config::read_secret_at;
using config::Value;

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(seconds * 1000.0));
}

void read_url(MapReader& in, mqtt::ClientSettings& mqtt) {
  const Value<std::string> url =
      in.need_text("url", "mqtt://HOST[:PORT] or, with TLS, mqtts://HOST[:PORT]");
  if (!url.given || !url.valid) return;
  try {
    mqtt.broker = mqtt::parse_broker_url(url.value);
  } catch (const std::invalid_argument& e) {
    in.error("url", fmt::format("{} (got '{}')", e.what(), quotable(url.value)));
  }
}

void read_tls(MapReader& in, const std::string& file, mqtt::ClientSettings& mqtt) {
  mqtt.ca_file = read_path(
      in, "ca_file", "authorities that may sign the broker's certificate, PEM; empty: the system's",
      file);
  mqtt.certificate_file =
      read_path(in, "certificate_file", "the box's own certificate, PEM; needs key", file);
  mqtt.key = read_secret_at(in, "key",
                            "private key of certificate_file, PEM, without a pass phrase", file);
  const bool own = !mqtt.certificate_file.empty();
  if (in.describing()) return;
  if (own != mqtt.key.given())
    in.error("certificate_file and key belong together. Give both, or leave both out");
  const bool any = own || !mqtt.ca_file.empty();
  if (any && !mqtt.broker.tls) in.error("url", "certificates need TLS: mqtts://");
}

void read_waits(MapReader& in, mqtt::ClientSettings& mqtt) {
  mqtt.keep_alive = std::chrono::seconds(in.integer(
      "keep_alive", {5, 600, "s", "a silent broker is given up after one to two of these"},
      mqtt.keep_alive.count()));
  const Value<double> shortest =
      in.number("reconnect_min",
                {"s", between(0.1, 600.0), "first wait before a new attempt; it doubles"}, 1.0);
  const Value<double> longest = in.number(
      "reconnect_max", {"s", between(0.1, 3600.0), "longest wait before a new attempt"}, 60.0);
  mqtt.reconnect_min = milliseconds(shortest);
  mqtt.reconnect_max = milliseconds(longest);
  if (shortest.valid && longest.valid && shortest > longest) {
    in.error("reconnect_max", "must be at least reconnect_min");
  }
}

}  // namespace

void check_identifier(MapReader& in, const char* key, const Value<std::string>& name) {
  if (!name.given || !name.valid || sparkplug::is_identifier(name.value)) return;
  in.error(key, fmt::format("must be a name without / + # of at most {} bytes (got '{}')",
                            sparkplug::kMostIdentifierBytes, quotable(name.value)));
}

void read_broker(MapReader in, const std::string& file, const std::string& client_id,
                 mqtt::ClientSettings& mqtt) {
  read_url(in, mqtt);
  const std::string meaning = "MQTT client identifier, unique at the broker; empty: " + client_id;
  mqtt.client_id = in.text("client_id", meaning.c_str(), "");
  mqtt.user = in.text("user", "name at the broker; empty: no user", "");
  mqtt.password = read_secret_at(in, "password", "of user", file);
  if (mqtt.password.given() && mqtt.user.empty()) in.error("password", "needs user");
  read_tls(in, file, mqtt);
  read_waits(in, mqtt);
}

}  // namespace loopwarden::broker
