// SPDX-License-Identifier: Apache-2.0
#include "services/feed/feeder.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "base/clock.hpp"
#include "services/net/sparkplug/topic.hpp"
#include "daemon/protocol/feed_line.hpp"

namespace loopwarden::feed {
namespace {

using protocol::FedValue;

constexpr std::chrono::milliseconds kRound{100};
// Values within this time share one line: one wake-up per value would cost more than all other
// work.
constexpr std::chrono::milliseconds kGathering{20};
constexpr std::chrono::minutes kBetweenComplaints{1};

std::int64_t ms_of(std::chrono::steady_clock::time_point moment) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(moment.time_since_epoch()).count();
}

mqtt::ClientSettings client_settings(const FeedConfig& config, const ForeignEdges& edges) {
  mqtt::ClientSettings settings = config.mqtt;
  std::set<std::string> filters;
  for (const TopicRule& rule : config.topics) filters.insert(rule.topic);
  for (const auto& [group, edge] : edges.edges()) {
    for (const char* type : {"NBIRTH", "NDEATH", "NDATA"}) {
      filters.insert(fmt::format("spBv1.0/{}/{}/{}", group, type, edge));
    }
    for (const char* type : {"DBIRTH", "DDEATH", "DDATA"}) {
      filters.insert(fmt::format("spBv1.0/{}/{}/{}/+", group, type, edge));
    }
  }
  for (const std::string& filter : filters) settings.subscriptions.push_back({filter});
  return settings;
}

}  // namespace

Feeder::Feeder(FeedConfig config)
    : config_(std::move(config)),
      topics_(config_.topics),
      edges_(config_.metrics),
      link_((config_.runtime_directory / "feed.sock").string()),
      client_(client_settings(config_, edges_)) {}

void Feeder::round() {
  for (const mqtt::Event& event : client_.events(std::min(kRound, config_.alive_interval))) {
    take(event);
  }
  std::this_thread::sleep_for(kGathering);
  for (const mqtt::Event& event : client_.events(std::chrono::milliseconds(0))) take(event);
  const std::int64_t now_ms = ms_of(Clock::now());
  topics_.look(now_ms, values_);
  edges_.look(now_ms, values_);
  keep_link();
  deliver();
  if (config_.ask_rebirth && client_.connected()) ask_rebirths();
  log_.look();
}

void Feeder::take(const mqtt::Event& event) {
  switch (event.kind) {
    case mqtt::Event::Kind::connected:
      log_.info("broker", "connected", "broker: connected to " + to_text(config_.mqtt.broker));
      return broker_came();
    case mqtt::Event::Kind::disconnected: return broker_went(event.why);
    case mqtt::Event::Kind::message: break;
  }
  // A broker may deliver retained messages before it has granted the last subscription.
  broker_came();
  take_message(event.message);
}

void Feeder::take_message(const mqtt::Message& message) {
  const std::int64_t now_ms = ms_of(Clock::now());
  std::string complaint;
  if (const auto topic = sparkplug::parse_topic(message.topic)) {
    // Births and data are never retained: a retained one is another program's mistake.
    if (!message.retain) edges_.take(*topic, message.payload, now_ms, values_, complaint);
  } else {
    topics_.take(message.topic, message.payload, message.retain, now_ms, values_, complaint);
  }
  if (!complaint.empty()) complain(complaint);
}

void Feeder::broker_came() {
  if (std::exchange(broker_there_, true)) return;
  edges_.connected(ms_of(Clock::now()));
  send_newest();
}

void Feeder::broker_went(const std::string& why) {
  log_.warn("broker", "away", "broker: " + why);
  deliver();
  topics_.disconnected(values_);
  edges_.disconnected(values_);
  for (FedValue& fed : values_) fed.source = broker_name();
  deliver();
  broker_there_ = false;
  client_.connect(std::nullopt);
}

void Feeder::keep_link() {
  const bool is_new = link_.connect(Clock::now());
  if (is_new) {
    log_.info("feed.sock", "connected", "feed.sock: connected");
    link_trouble_.clear();
    if (!config_.feeder.empty()) link_.send(protocol::feed_sign_of_life(config_.feeder));
    broker_there_ ? send_newest() : send_lost();
  } else if (!link_.why().empty() && link_.why() != link_trouble_) {
    link_trouble_ = link_.why();
    log_.warn("feed.sock", "away", link_trouble_);
  }
}

void Feeder::ask_rebirths() {
  for (const auto& [group, edge] : edges_.to_ask(ms_of(Clock::now()))) {
    log_.info(group + '/' + edge, "asked", group + '/' + edge + ": a rebirth is asked for");
    client_.publish(
        {.topic = to_text(sparkplug::Topic{group, sparkplug::MessageType::ncmd, edge, ""}),
         .payload = rebirth_request(static_cast<std::uint64_t>(base::utc_ms())),
         .qos = mqtt::Qos::at_most_once,
         .retain = false});
  }
}

// While the broker is away, values are only remembered.
void Feeder::deliver() {
  for (const FedValue& fed : values_) newest_.insert_or_assign(fed.name, fed);
  const std::vector<FedValue> values = std::exchange(values_, {});
  const Clock::time_point now = Clock::now();
  if (broker_there_) {
    send(values);
    if (now - last_line_ >= config_.alive_interval) {
      link_.send(protocol::feed_sign_of_life());
      last_line_ = now;
    }
  }
  link_.flush(now);
}

void Feeder::send(const std::vector<FedValue>& values) {
  for (const std::string& line : protocol::write_feed_lines(values)) {
    link_.send(line);
    last_line_ = Clock::now();
  }
}

void Feeder::send_newest() {
  std::vector<FedValue> all;
  for (const auto& [name, fed] : newest_) all.push_back(fed);
  send(all);
}

// Sends that the values are lost with the broker: a daemon that has started does not know it.
void Feeder::send_lost() {
  std::vector<FedValue> all;
  const auto add = [&](const std::string& name) {
    all.push_back({.name = name,
                   .quality = FedValue::Quality::bad,
                   .reason = FedValue::Reason::link,
                   .source = broker_name()});
  };
  for (const TopicRule& rule : config_.topics) add(rule.name);
  for (const MetricRule& rule : config_.metrics) add(rule.name);
  send(all);
}

std::string Feeder::broker_name() const {
  return ("broker " + to_text(config_.mqtt.broker)).substr(0, FedValue::kLongestSource);
}

void Feeder::complain(const std::string& what) {
  ++complaints_;
  if (Clock::now() < complain_again_) return;
  complain_again_ = Clock::now() + kBetweenComplaints;
  spdlog::warn("{} (so many since the last such line: {})", what, std::exchange(complaints_, 0));
}

std::string Feeder::status() const {
  const Topics::Counts& topics = topics_.counts();
  const ForeignEdges::Counts edges = edges_.counts();
  return fmt::format(
      "broker {}, feed.sock {}{}; values heard: {} of {}; bad payloads {}, unknown {}, retained "
      "{}, timeouts {}, dropped {}, historical {}, missing {}, deaths {}",
      broker_there_ ? "connected" : "away", link_.connected() ? "connected" : "away",
      edges_.all_born() ? "" : ", births are missing", newest_.size(),
      config_.topics.size() + config_.metrics.size(), topics.bad_payloads + edges.bad_payloads,
      topics.unknown + edges.unknown, topics.retained, topics.timeouts + edges.timeouts,
      edges.dropped, edges.historical, edges.missing, edges.deaths);
}

}  // namespace loopwarden::feed
