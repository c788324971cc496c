// SPDX-License-Identifier: Apache-2.0
#include "services/feed/browse.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "base/clock.hpp"
#include "base/exit_code.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/net/sparkplug/rebirth_policy.hpp"
#include "services/net/sparkplug/topic.hpp"
#include "services/feed/values/birth_list.hpp"
#include "services/feed/values/foreign_edges.hpp"

namespace loopwarden::feed {
namespace {

// Returns filters for births and data of nodes and devices. Data shows that its sender exists.
std::vector<mqtt::Subscription> all_of(const std::string& group) {
  std::vector<mqtt::Subscription> filters;
  for (const char* type : {"NBIRTH", "NDATA"}) {
    filters.push_back({fmt::format("spBv1.0/{}/{}/+", group, type)});
  }
  for (const char* type : {"DBIRTH", "DDATA"}) {
    filters.push_back({fmt::format("spBv1.0/{}/{}/+/+", group, type)});
  }
  return filters;
}

void ask_for_births(mqtt::Client& client, const BirthList& list,
                    std::map<BirthList::EdgeName, sparkplug::RebirthWait>& waits) {
  const std::int64_t now_ms = base::utc_ms();
  for (const auto& edge : list.unborn()) {
    sparkplug::RebirthWait& wait = waits[edge];
    if (!wait.may_ask(now_ms)) continue;
    wait.asked(now_ms);
    client.publish({.topic = to_text(sparkplug::Topic{edge.first, sparkplug::MessageType::ncmd,
                                                      edge.second, ""}),
                    .payload = rebirth_request(static_cast<std::uint64_t>(now_ms)),
                    .qos = mqtt::Qos::at_most_once,
                    .retain = false});
  }
}

}  // namespace

int browse(FeedConfig config, const std::string& group, std::chrono::seconds patience) {
  config.mqtt.client_id += "-browse";  // the service may run at the same time
  config.mqtt.subscriptions = all_of(group);
  mqtt::Client client(std::move(config.mqtt));
  client.connect(std::nullopt);
  BirthList list;
  std::map<BirthList::EdgeName, sparkplug::RebirthWait> waits;
  std::string trouble = "the broker does not answer";
  const auto end = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < end) {
    for (const mqtt::Event& event : client.events(std::chrono::milliseconds(100))) {
      if (event.kind == mqtt::Event::Kind::connected) trouble.clear();
      if (event.kind == mqtt::Event::Kind::disconnected) {
        trouble = event.why;
        client.connect(std::nullopt);
      }
      if (event.kind != mqtt::Event::Kind::message || event.message.retain) continue;
      const auto topic = sparkplug::parse_topic(event.message.topic);
      if (!topic) continue;
      try {
        list.take(*topic, event.message.payload);
      } catch (const sparkplug::BadPayload& e) {
        fmt::print(stderr, "{}: {}\n", event.message.topic, e.what());
      }
    }
    if (config.ask_rebirth && client.connected()) ask_for_births(client, list, waits);
  }
  client.leave();
  for (const auto& [of_group, edge] : list.unborn()) {
    fmt::print(stderr, "{}/{}: no birth was heard{}\n", of_group, edge,
               config.ask_rebirth ? "" : "; `ask_rebirth: true` asks for it");
  }
  if (!trouble.empty()) fmt::print(stderr, "broker: {}\n", trouble);
  if (list.metrics() == 0) {
    fmt::print(stderr, "{}: no metric was heard of in {} s\n", group, patience.count());
    return kExitIo;
  }
  fmt::print("{}", list.csv());
  return kExitOk;
}

}  // namespace loopwarden::feed
