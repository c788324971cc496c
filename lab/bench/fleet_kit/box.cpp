// SPDX-License-Identifier: Apache-2.0
#include "lab/bench/fleet_kit/box.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::bench {
namespace {

using sparkplug::DataType;
using sparkplug::MessageType;
using sparkplug::Metric;
using sparkplug::Payload;
using sparkplug::Types;

constexpr std::int64_t kResendWindowMs = 60'000;
constexpr int kMostResentAtOnce = 5;  // per tick, so that present values are not late
constexpr std::array kNames{"pv", "sp", "co", "stem", "variability", "travel"};

Metric metric(const std::string& name, DataType type, sparkplug::Value value,
              std::int64_t time_ms) {
  Metric made;
  made.name = name;
  made.type = type;
  made.value = std::move(value);
  made.time_ms = static_cast<std::uint64_t>(time_ms);
  return made;
}

std::uint64_t alias_of(int loop, std::size_t place) {
  return 1000U * static_cast<std::uint64_t>(loop + 1) + place;
}

std::string device_of(int loop) { return "FIC-" + std::to_string(101 + loop); }

mqtt::ClientSettings client_settings(const BoxSettings& settings) {
  mqtt::ClientSettings client;
  client.broker = settings.broker;
  client.client_id = settings.group + '-' + settings.edge + settings.client_suffix;
  client.keep_alive = std::chrono::seconds(15);
  client.reconnect_min = std::chrono::milliseconds(500);
  client.reconnect_max = std::chrono::milliseconds(5000);
  client.subscriptions = {{sparkplug::state_topic(settings.host)},
                          {"spBv1.0/" + settings.group + "/NCMD/" + settings.edge}};
  return client;
}

}  // namespace

Box::Box(BoxSettings settings)
    : settings_(std::move(settings)),
      session_(!settings_.host.empty(), std::nullopt),
      client_(client_settings(settings_)),
      numbers_(static_cast<std::size_t>(settings_.loops), settings_.count_from),
      times_ms_(static_cast<std::size_t>(settings_.loops), 0),
      due_ms_(static_cast<std::size_t>(settings_.loops), 0) {
  connect();
}

void Box::connect() {
  const std::uint8_t bd_seq = session_.connecting();
  Payload death;
  death.metrics.push_back(metric("bdSeq", DataType::int64, std::int64_t{bd_seq}, 0));
  const sparkplug::Topic topic{settings_.group, MessageType::ndeath, settings_.edge, {}};
  client_.connect(
      mqtt::Message{to_text(topic), encode(death, Types::sent), mqtt::Qos::at_least_once, false});
}

void Box::tick(std::int64_t now_ms, bool sample) {
  for (const mqtt::Event& event : client_.events(std::chrono::milliseconds(0)))
    handle(event, now_ms);
  if (sample) take_samples(now_ms);
  if (session_.live()) send_waiting(now_ms);
}

void Box::handle(const mqtt::Event& event, std::int64_t now_ms) {
  switch (event.kind) {
    case mqtt::Event::Kind::connected:
      follow(session_.connected(), now_ms);
      // A retained message may arrive before the last subscription is granted.
      if (early_state_) hear(*std::exchange(early_state_, std::nullopt), now_ms);
      return;
    case mqtt::Event::Kind::message: return hear(event.message, now_ms);
    case mqtt::Event::Kind::disconnected: break;
  }
  if (session_.live()) lost(now_ms);
  early_state_.reset();
  session_.disconnected();
  connect();
}

void Box::hear(const mqtt::Message& message, std::int64_t now_ms) {
  if (message.topic == sparkplug::state_topic(settings_.host)) {
    const auto state = sparkplug::parse_host_state(message.payload);
    if (!state) return;
    if (session_.state() == sparkplug::EdgeSession::State::offline) early_state_ = message;
    const bool was_live = session_.live();
    const auto next = session_.host_said(*state);
    if (was_live && !session_.live()) lost(now_ms);
    return follow(next, now_ms);
  }
  try {
    const Payload payload = sparkplug::decode(message.payload);
    const Metric* rebirth = payload.find("Node Control/Rebirth");
    if (rebirth != nullptr && rebirth->value == sparkplug::Value(true)) {
      follow(session_.rebirth_asked(), now_ms);
    }
  } catch (const sparkplug::BadPayload&) {
    return;  // error of another program
  }
}

void Box::follow(sparkplug::EdgeSession::Next next, std::int64_t now_ms) {
  using Next = sparkplug::EdgeSession::Next;
  if (next == Next::births) give_birth(now_ms);
  if (next == Next::leave) client_.leave();
}

// Messages sent shortly before the loss may not have arrived.
void Box::lost(std::int64_t now_ms) {
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    if (samples_[i].sent_ms < now_ms - kResendWindowMs) continue;
    waiting_from_ = std::min(waiting_from_, i);
    return;
  }
}

void Box::give_birth(std::int64_t now_ms) {
  ++births_;
  Payload birth;
  birth.time_ms = static_cast<std::uint64_t>(now_ms);
  birth.seq = session_.birth_seq();
  birth.metrics.push_back(
      metric("bdSeq", DataType::int64, std::int64_t{session_.bd_seq()}, now_ms));
  birth.metrics.push_back(metric("Node Control/Rebirth", DataType::boolean, false, now_ms));
  birth.metrics.push_back(metric("version", DataType::string, std::string("0.2.0"), now_ms));
  birth.metrics.push_back(metric("config_hash", DataType::uint32, std::uint64_t{0xC0FFEE}, now_ms));
  publish(MessageType::nbirth, "", std::move(birth), Types::sent);
  for (int loop = 0; loop < settings_.loops; ++loop) {
    Payload device;
    device.time_ms = static_cast<std::uint64_t>(now_ms);
    device.seq = session_.next_seq();
    device.metrics = device_birth(loop);
    if (loop == 0 && settings_.births_to_lose > 0) {
      --settings_.births_to_lose;
      continue;
    }
    publish(MessageType::dbirth, device_of(loop), std::move(device), Types::sent);
  }
}

std::vector<Metric> Box::device_birth(int loop) const {
  const auto place = static_cast<std::size_t>(loop);
  const std::int64_t time_ms = times_ms_[place];
  std::vector<Metric> metrics;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    // Before the first sample there is no value.
    sparkplug::Value value;
    if (numbers_[place] > settings_.count_from) value = static_cast<double>(numbers_[place]);
    Metric one =
        metric(kNames[i], DataType::float64, std::move(value), std::max<std::int64_t>(time_ms, 1));
    if (time_ms == 0) one.time_ms.reset();
    one.alias = alias_of(loop, i);
    one.properties = {{"unit", DataType::string, std::string("L/min")},
                      {"engLow", DataType::float64, 0.0},
                      {"engHigh", DataType::float64, 10.0}};
    metrics.push_back(std::move(one));
  }
  metrics.push_back(metric("tag", DataType::string, settings_.edge + '/' + device_of(loop), 0));
  metrics.back().time_ms.reset();
  return metrics;
}

void Box::take_samples(std::int64_t now_ms) {
  for (int loop = 0; loop < settings_.loops; ++loop) {
    const auto place = static_cast<std::size_t>(loop);
    std::int64_t& due = due_ms_[place];
    const std::int64_t stagger = settings_.period_ms * loop / settings_.loops + settings_.offset_ms;
    // At the start, and after the clock was set.
    if (due == 0 || due > now_ms + 2 * settings_.period_ms ||
        due < now_ms - 2 * settings_.period_ms) {
      due = now_ms + stagger;
    }
    if (now_ms < due) continue;
    due += settings_.period_ms;
    times_ms_[place] = now_ms;
    samples_.push_back({now_ms, loop, ++numbers_[place], 0});
  }
}

void Box::send_waiting(std::int64_t now_ms) {
  int again = 0;
  while (waiting_from_ < samples_.size() && again < kMostResentAtOnce) {
    Sample& sample = samples_[waiting_from_];
    const bool late = sample.sent_ms != 0 || sample.time_ms < now_ms - 2000;
    if (!send(sample, late, now_ms)) return;
    ++waiting_from_;
    again += late ? 1 : 0;
  }
  while (waiting_from_ > 0 && samples_.front().sent_ms < now_ms - kResendWindowMs) {
    samples_.pop_front();
    --waiting_from_;
  }
}

bool Box::send(Sample& sample, bool historical, std::int64_t now_ms) {
  Payload payload;
  payload.time_ms = static_cast<std::uint64_t>(now_ms);
  payload.metrics.reserve(kNames.size());
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    Metric one = metric("", DataType::float64, static_cast<double>(sample.number), sample.time_ms);
    one.alias = alias_of(sample.loop, i);
    one.historical = historical;
    payload.metrics.push_back(std::move(one));
  }
  if (client_.waiting() > 100) return false;
  payload.seq = session_.next_seq();
  if (!publish(MessageType::ddata, device_of(sample.loop), std::move(payload), Types::left_out)) {
    return false;
  }
  sent_again_ += sample.sent_ms != 0 ? 1 : 0;
  ++sent_;
  sample.sent_ms = now_ms;
  return true;
}

bool Box::publish(MessageType type, const std::string& device, Payload payload, Types types) {
  return client_.publish({to_text(sparkplug::Topic{settings_.group, type, settings_.edge, device}),
                          encode(payload, types), mqtt::Qos::at_most_once, false});
}

bool Box::drained() const {
  return session_.live() && waiting_from_ == samples_.size() && client_.waiting() == 0;
}

std::size_t Box::stored() const { return samples_.size() - waiting_from_; }

}  // namespace loopwarden::bench
