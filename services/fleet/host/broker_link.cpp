// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/broker_link.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "base/clock.hpp"
#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::fleet {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kTick{50};
constexpr milliseconds kGoodbye{3000};  // the client's time to disconnect, and a margin
constexpr std::size_t kMostWaiting = 10'000;

std::vector<mqtt::Subscription> subscriptions_of(const LinkSettings& settings) {
  const std::string group = settings.group.empty() ? "+" : settings.group;
  std::vector<mqtt::Subscription> all{{sparkplug::state_topic(settings.host_id)}};
  for (const char* type : {"NBIRTH", "NDEATH", "NDATA"}) {
    all.push_back({"spBv1.0/" + group + "/" + type + "/+"});
  }
  for (const char* type : {"DBIRTH", "DDEATH", "DDATA"}) {
    all.push_back({"spBv1.0/" + group + "/" + type + "/+/+"});
  }
  return all;
}

}  // namespace

BrokerLink::BrokerLink(LinkSettings settings, Spool& spool)
    : settings_(std::move(settings)), spool_(spool) {
  thread_.start({.name = "lw-broker", .stack_bytes = 1024UL * 1024UL}, [this] { run(); });
}

BrokerLink::~BrokerLink() { stop(); }

void BrokerLink::stop() {
  quit_ = true;
  thread_.join();
}

bool BrokerLink::send(mqtt::Message message) {
  const std::lock_guard lock(mutex_);
  if (!connected_ || waiting_.size() >= kMostWaiting) return false;
  waiting_.push_back(std::move(message));
  return true;
}

void BrokerLink::run() {
  while (!quit_) {
    if (owned_) {
      serve();
    } else {
      end(goodbye_);
      std::this_thread::sleep_for(kTick);
    }
  }
  end(owned_ || goodbye_);
}

void BrokerLink::serve() {
  if (!client_) open();
  log_.look();
  for (mqtt::Event& event : client_->events(kTick)) handle(std::move(event));
  if (!connected_) return;
  if (said_online_ != accepting_.load()) say_state(accepting_);
  send_waiting();
}

void BrokerLink::open() {
  gone_ = false;
  mqtt::ClientSettings settings = settings_.client;
  settings.client_id = settings_.host_id;
  settings.subscriptions = subscriptions_of(settings_);
  client_ = std::make_unique<mqtt::Client>(std::move(settings));
  try_connection();
}

void BrokerLink::forget_waiting() {
  const std::lock_guard lock(mutex_);
  connected_ = false;
  waiting_.clear();
}

void BrokerLink::try_connection() {
  forget_waiting();
  said_online_.reset();
  // The new time is later than every earlier state, also if this host's clock was set back.
  state_time_ms_ = std::max(state_time_ms_ + 1, static_cast<std::uint64_t>(base::utc_ms()));
  client_->connect(mqtt::Message{.topic = sparkplug::state_topic(settings_.host_id),
                                 .payload = to_text(sparkplug::HostState{false, state_time_ms_}),
                                 .qos = mqtt::Qos::at_least_once,
                                 .retain = true});
}

void BrokerLink::handle(mqtt::Event event) {
  switch (event.kind) {
    case mqtt::Event::Kind::connected:
      log_.info("broker", "connected",
                settings_.host_id + ": connected to " + to_text(settings_.client.broker));
      connected_ = true;
      ++connections_;
      return;
    case mqtt::Event::Kind::disconnected:
      log_.warn("broker", "away", settings_.host_id + ": broker: " + event.why);
      try_connection();
      return;
    case mqtt::Event::Kind::message: break;
  }
  if (sparkplug::parse_state_topic(event.message.topic)) return hear_own_state(event.message);
  // Births and data are never retained. A retained one is a publisher's error.
  if (event.message.retain) return;
  spool_.push(
      {std::move(event.message.topic), std::move(event.message.payload), base::utc_ms(), false});
}

void BrokerLink::hear_own_state(const mqtt::Message& message) {
  const auto state = sparkplug::parse_host_state(message.payload);
  if (!state) return;
  if (state->time_ms > state_time_ms_) {
    // Edges follow the state with the latest time, so this connection's state would have no effect.
    log_.warn("broker", "later state",
              settings_.host_id + ": the broker has a state of a later time; connecting again");
    state_time_ms_ = state->time_ms;
    if (client_) client_->leave();
    return;
  }
  // The will of an older connection has arrived late.
  if (said_online_ == true && !state->online) said_online_.reset();
}

void BrokerLink::say_state(bool online) {
  const mqtt::Message message{.topic = sparkplug::state_topic(settings_.host_id),
                              .payload = to_text(sparkplug::HostState{online, state_time_ms_}),
                              .qos = mqtt::Qos::at_least_once,
                              .retain = true};
  if (client_->publish(message)) said_online_ = online;
}

void BrokerLink::send_waiting() {
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && client_->publish(waiting_.front())) waiting_.pop_front();
}

void BrokerLink::end(bool goodbye) {
  if (connected_ && goodbye) {
    // A death that is not a will has the time at which it is published.
    state_time_ms_ = std::max(state_time_ms_, static_cast<std::uint64_t>(base::utc_ms()));
    say_state(false);
    client_->leave();
    await_end();
  }
  forget_waiting();
  client_.reset();
  gone_ = true;
}

// Waits for the end of the connection. Messages that still arrive go to the spool.
void BrokerLink::await_end() {
  const auto end = std::chrono::steady_clock::now() + kGoodbye;
  while (connected_ && std::chrono::steady_clock::now() < end) {
    for (mqtt::Event& event : client_->events(kTick)) {
      if (event.kind == mqtt::Event::Kind::disconnected) connected_ = false;
      if (event.kind == mqtt::Event::Kind::message) handle(std::move(event));
    }
  }
}

}  // namespace loopwarden::fleet
