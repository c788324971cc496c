// SPDX-License-Identifier: Apache-2.0
#include "services/edge/edge_node.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "base/clock.hpp"
#include "config/diagnostic.hpp"

namespace loopwarden::edge {
namespace {

using sparkplug::EdgeSession;
using sparkplug::MessageType;
using sparkplug::Metric;
using sparkplug::Payload;
using sparkplug::Topic;
using sparkplug::Types;
using Next = EdgeSession::Next;

// With more messages than this not yet on the network, the network counts as stalled.
constexpr std::size_t kStalled = 500;
// Births of a thousand loops go out at once.
constexpr std::size_t kMostWaiting = 20'000;
constexpr std::size_t kPartsALook = 8;
constexpr std::chrono::seconds kGoodbye{3};  // that of the client, plus a reserve
constexpr std::chrono::seconds kFirstConnection{2};

mqtt::ClientSettings settings_of(const EdgeConfig& config) {
  mqtt::ClientSettings settings = config.mqtt;
  settings.most_waiting = kMostWaiting;
  const std::string node = "spBv1.0/" + config.group;
  settings.subscriptions = {{node + "/NCMD/" + config.edge, mqtt::Qos::at_least_once},
                            {node + "/DCMD/" + config.edge + "/#", mqtt::Qos::at_least_once}};
  if (!config.primary_host.empty()) {
    settings.subscriptions.push_back(
        {sparkplug::state_topic(config.primary_host), mqtt::Qos::at_least_once});
  }
  return settings;
}

std::int64_t ms_of(std::chrono::steady_clock::time_point moment) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(moment.time_since_epoch()).count();
}

std::uint64_t system_ms() { return static_cast<std::uint64_t>(base::utc_ms()); }

// Returns bdSeq from the store. If the store can't be read, bdSeq starts again.
std::optional<std::uint8_t> last_bd_seq(Store& store) {
  try {
    return store.bd_seq();
  } catch (const sqlite::Error& e) {
    spdlog::error("store: {}", e.what());
    return std::nullopt;
  }
}

}  // namespace

EdgeNode::EdgeNode(EdgeConfig config)
    : config_(std::move(config)),
      store_(config_.state_directory / "store.sqlite", config_.most_stored_bytes),
      outbox_(store_, config_.resend_window),
      session_(!config_.primary_host.empty(), last_bd_seq(store_)),
      view_(config_.runtime_directory, config_.dead_bands, config_.commissions),
      orders_(config_.runtime_directory, config_.orders),
      files_(config_.most_file_bytes, config_.file_part_bytes),
      node_("", BoxModel().node_specs(), 1),
      client_(settings_of(config_)) {}

void EdgeNode::start() {
  connect();
  // The first reading is sent or stored, depending on whether the broker is there.
  const std::vector<mqtt::Event> events = client_.events(kFirstConnection);
  next_look_ = Clock::now();
  starting_ = true;
  look();
  starting_ = false;
  for (const mqtt::Event& event : events) take(event);
  if (daemon_there_ && !session_.live()) keep_births();
}

void EdgeNode::round() {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(next_look_ - Clock::now());
  for (const mqtt::Event& event : client_.events(std::max(left, std::chrono::milliseconds(0))))
    take(event);
  answer_rebirth();
  log_.look();
  if (Clock::now() < next_look_) return;
  // Missed readings are not made up for.
  next_look_ = std::max(next_look_ + config_.interval, Clock::now());
  look();
  tell_outcomes();
  outbox_.tidy(Clock::now());
  if (!session_.live()) return;
  const std::size_t most = std::max<std::size_t>(
      1, config_.replay_per_second * static_cast<std::size_t>(config_.interval.count()) / 1000);
  outbox_.replay(most, Clock::now(), [this](const Report& report) { return send(report, true); });
  send_files();
}

void EdgeNode::end() {
  if (session_.live()) client_.publish(death());
  session_.disconnected();
  client_.leave();
  const auto gone = [](const mqtt::Event& event) {
    return event.kind == mqtt::Event::Kind::disconnected;
  };
  for (const Clock::time_point patience = Clock::now() + kGoodbye; Clock::now() < patience;) {
    const std::vector<mqtt::Event> events = client_.events(std::chrono::milliseconds(100));
    if (std::any_of(events.begin(), events.end(), gone)) break;
  }
  outbox_.lost(Clock::now());
}

std::string EdgeNode::status() const {
  const char* broker = session_.live() ? "live"
                       : session_.state() == EdgeSession::State::waiting_for_host
                           ? "connected, primary host is not online"
                           : "not connected";
  return fmt::format("broker: {}; daemon: {}; {} loops; {} reports wait, {} dropped", broker,
                     daemon_there_ ? "there" : "away", devices_.size(), outbox_.waiting(),
                     outbox_.dropped());
}

// --- the daemon ---

void EdgeNode::look() {
  try {
    const bool changed = view_.look();
    if (!daemon_there_ || changed) {
      daemon_came(changed);
    } else {
      tell_changes();
    }
  } catch (const std::exception& e) {
    daemon_went(e.what());
  }
}

void EdgeNode::daemon_came(bool changed) {
  daemon_there_ = true;
  daemon_trouble_.clear();
  log_.info("daemon", "there", fmt::format("daemon: {} loops", view_.model().loops().size()));
  if (changed) make_devices();
  if (!session_.live()) {
    if (!starting_) keep_births();
  } else if (changed) {
    births();
  } else {
    device_births();
    tell_changes();
  }
}

// Stores the values of a birth while no host receives births.
void EdgeNode::keep_births() {
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    Report report{devices_[i].name(), devices_[i].birth(view_.loop_reading(i), now_ms())};
    std::erase_if(report.metrics,
                  [](const Metric& metric) { return metric.value == sparkplug::Value{}; });
    for (Metric& metric : report.metrics) metric.properties.clear();
    outbox_.keep(std::move(report));
  }
}

void EdgeNode::make_devices() {
  node_ = Device("", view_.model().node_specs(), 1);
  // Until a birth, changes are relative to this reading.
  node_.birth(node_reading(), now_ms());
  devices_.clear();
  by_name_.clear();
  std::uint64_t alias = node_.next_alias();
  for (const LoopModel& loop : view_.model().loops()) {
    by_name_.emplace(loop.device, devices_.size());
    devices_.emplace_back(loop.device, loop.specs, alias);
    alias = devices_.back().next_alias();
  }
}

void EdgeNode::daemon_went(const std::string& why) {
  if (daemon_trouble_ != why) log_.warn("daemon", "away", "daemon: " + why);
  daemon_trouble_ = why;
  if (!daemon_there_) return;
  daemon_there_ = false;
  if (!session_.live()) return;
  device_deaths();
  report({"", node_.changes(node_reading(), now_ms(), config_.slow_interval)});
}

void EdgeNode::tell_changes() {
  const std::uint64_t time_ms = now_ms();
  report({"", node_.changes(node_reading(), time_ms, config_.slow_interval)});
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    report({devices_[i].name(),
            devices_[i].changes(view_.loop_reading(i), time_ms, config_.slow_interval)});
  }
}

// --- the broker ---

void EdgeNode::connect() {
  const std::uint8_t bd_seq = session_.connecting();
  try {
    store_.keep_bd_seq(bd_seq);
  } catch (const sqlite::Error& e) {
    spdlog::error("store: {}", e.what());
  }
  client_.connect(death());
}

void EdgeNode::take(const mqtt::Event& event) {
  switch (event.kind) {
    case mqtt::Event::Kind::connected:
      log_.info("broker", "connected", "broker: connected");
      follow(session_.connected());
      break;
    case mqtt::Event::Kind::disconnected:
      log_.warn("broker", "away", "broker: " + event.why);
      session_.disconnected();
      outbox_.lost(Clock::now());
      connect();
      break;
    case mqtt::Event::Kind::message: take_message(event.message); break;
  }
}

void EdgeNode::take_message(const mqtt::Message& message) {
  if (const auto host = sparkplug::parse_state_topic(message.topic)) {
    const auto state = sparkplug::parse_host_state(message.payload);
    if (host == config_.primary_host && state) follow(session_.host_said(*state));
    return;
  }
  const std::optional<Topic> topic = sparkplug::parse_topic(message.topic);
  // A retained command is an old one.
  if (!topic || message.retain || topic->group != config_.group || topic->edge != config_.edge)
    return;
  try {
    const Payload payload = sparkplug::decode(message.payload);
    if (topic->type == MessageType::ncmd) node_command(payload);
    if (topic->type == MessageType::dcmd) device_command(topic->device, payload);
  } catch (const sparkplug::BadPayload& e) {
    log_.warn("command", "bad", fmt::format("{}: {}", message.topic, e.what()));
  }
}

void EdgeNode::follow(Next next) {
  if (next == Next::births) births();
  if (next == Next::leave) leave();
}

// Hosts may send many requests at once. Each answer consists of all births, so the requests in
// between share the next answer.
void EdgeNode::answer_rebirth() {
  if (!rebirth_waits_) return;
  // A connection that becomes live starts with births.
  if (session_.live() && !rebirths_.take(ms_of(Clock::now()))) return;
  rebirth_waits_ = false;
  follow(session_.rebirth_asked());
}

void EdgeNode::births() {
  std::vector<Metric> metrics = node_.birth(node_reading(), now_ms());
  publish(MessageType::nbirth, "", std::move(metrics));
  if (daemon_there_) device_births();
}

void EdgeNode::device_births() {
  const std::uint64_t time_ms = now_ms();
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    publish(MessageType::dbirth, devices_[i].name(),
            devices_[i].birth(view_.loop_reading(i), time_ms));
  }
}

void EdgeNode::device_deaths() {
  for (const Device& device : devices_) publish(MessageType::ddeath, device.name(), {});
}

// Leaves the broker when the primary host is gone: sends the node's death, then a new connection
// waits for the host.
void EdgeNode::leave() {
  log_.warn("host", "offline", fmt::format("primary host {} is not online", config_.primary_host));
  client_.publish(death());
  client_.leave();
  outbox_.lost(Clock::now());
}

// --- commands ---

void EdgeNode::node_command(const Payload& payload) {
  std::vector<Metric> metrics = payload.metrics;
  std::erase_if(metrics, [&](Metric& metric) {
    const MetricSpec* spec = node_.meant_by(metric);
    if (spec != nullptr) metric.name = spec->name;
    return spec == nullptr;
  });
  const Command command = read_command(metrics, false);
  for (const std::string& why : command.refused) log_.warn("command", "refused", "NCMD: " + why);
  if (command.rebirth) {
    log_.info("rebirth", "asked", "a host asks for births");
    rebirth_waits_ = true;
    answer_rebirth();
  }
  if (command.acknowledge_all) acknowledge_all();
}

void EdgeNode::acknowledge_all() {
  if (!daemon_there_) return;
  std::vector<Orders::Loop> loops;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    loops.push_back(
        {devices_[i].name(), view_.model().loops()[i].tag, !view_.unacknowledged(i).empty()});
  }
  orders_.acknowledge_all(loops);
  tell_outcomes();
}

void EdgeNode::device_command(const std::string& name, const Payload& payload) {
  Device* device = find(name);
  if (device == nullptr) {
    log_.warn("command", "unknown device",
              fmt::format("DCMD for {}, which is not a device of this box", name));
    return;
  }
  const auto loop = static_cast<std::size_t>(device - devices_.data());
  std::vector<Metric> metrics = payload.metrics;
  for (Metric& metric : metrics) {
    const MetricSpec* spec = device->meant_by(metric);
    if (spec == nullptr) continue;
    metric.name = spec->name;
    metric.value = sparkplug::retyped(std::move(metric.value), spec->type);
  }
  const Command command = read_command(metrics, true);
  for (const std::string& why : command.refused) orders_.refuse(name, "refused: " + why);
  for (const Order& order : command.orders)
    orders_.give(name, view_.model().loops()[loop].tag, order);
  for (const std::string& wanted : command.evidence) want_evidence(loop, wanted);
  tell_outcomes();
}

void EdgeNode::want_evidence(std::size_t loop, const std::string& wanted) {
  const std::string& device = devices_[loop].name();
  const std::string what = "request/evidence " + config::quotable(wanted) + ": ";
  try {
    const auto folder = view_.evidence(loop, wanted);
    const std::string why =
        folder ? files_.add(device, wanted, *folder) : "refused: no such evidence";
    if (!why.empty()) orders_.refuse(device, what + why);
  } catch (const protocol::DaemonError& e) {
    orders_.refuse(device, what + (e.refused() ? "refused: " : "not known: ") + e.what());
  } catch (const std::exception& e) {
    orders_.refuse(device, what + "not known: " + e.what());
  }
}

void EdgeNode::tell_outcomes() {
  for (const Orders::Outcome& outcome : orders_.outcomes()) {
    Metric metric;
    metric.name = "order/result";
    metric.type = sparkplug::DataType::string;
    metric.time_ms = now_ms();
    metric.value = outcome.text;
    report({outcome.device, {std::move(metric)}});
  }
}

// --- out ---

bool EdgeNode::publish(MessageType type, const std::string& device, std::vector<Metric> metrics) {
  const std::uint8_t seq = type == MessageType::nbirth ? session_.birth_seq() : session_.next_seq();
  const Payload payload{.time_ms = system_ms(), .seq = seq, .metrics = std::move(metrics)};
  return client_.publish(
      {.topic = sparkplug::to_text(Topic{config_.group, type, config_.edge, device}),
       .payload = sparkplug::encode(payload, Types::sent),
       .qos = mqtt::Qos::at_most_once,
       .retain = false});
}

// Returns false if it can't be sent now.
bool EdgeNode::send(const Report& report, bool historical) {
  if (!session_.live() || client_.waiting() > kStalled) return false;
  const Device* device = find(report.device);
  if (device != nullptr && device != &node_ && !daemon_there_) return false;
  std::vector<Metric> metrics = report.metrics;
  // Stored before loops or metrics changed: no birth names these metrics, so no host could use
  // them.
  std::erase_if(metrics, [&](const Metric& m) { return device == nullptr || !device->has(m); });
  if (metrics.empty()) {
    outbox_.drop_one();
    return true;
  }
  for (Metric& metric : metrics) {
    metric.alias = device->alias_of(metric.name);
    if (metric.alias) metric.name.clear();
    metric.historical = historical;
  }
  const MessageType type = report.device.empty() ? MessageType::ndata : MessageType::ddata;
  // The specification recommends data without types, but clients in use can't read such values.
  return publish(type, report.device, std::move(metrics));
}

void EdgeNode::report(Report report) {
  if (report.metrics.empty()) return;
  if (send(report, false)) {
    outbox_.sent(std::move(report), Clock::now());
  } else {
    outbox_.keep(std::move(report));
  }
}

void EdgeNode::send_files() {
  for (std::size_t i = 0; i < kPartsALook && daemon_there_ && client_.waiting() < kPartsALook;
       ++i) {
    std::optional<FileParts::Part> part = files_.next();
    if (!part) return;
    part->metric.time_ms = now_ms();
    // A part that can't be sent now is tried again.
    if (!send({part->device, {std::move(part->metric)}}, false)) return;
    files_.gone();
  }
}

mqtt::Message EdgeNode::death() const {
  Metric bd_seq;
  bd_seq.name = "bdSeq";
  bd_seq.type = sparkplug::DataType::int64;
  bd_seq.time_ms = system_ms();
  bd_seq.value = std::int64_t{session_.bd_seq()};
  const Payload payload{.time_ms = system_ms(), .seq = {}, .metrics = {std::move(bd_seq)}};
  return {.topic = sparkplug::to_text(Topic{config_.group, MessageType::ndeath, config_.edge, ""}),
          .payload = sparkplug::encode(payload, Types::sent),
          .qos = mqtt::Qos::at_least_once,
          .retain = false};
}

Reading EdgeNode::node_reading() const {
  Extras own{{"Node Control/Rebirth", false},
             {"daemon/online", daemon_there_},
             {"store/waiting", outbox_.waiting()},
             {"store/dropped", outbox_.dropped()}};
  own["bdSeq"] = std::int64_t{session_.bd_seq()};
  return view_.node_reading(own);
}

Device* EdgeNode::find(const std::string& device) {
  if (device.empty()) return &node_;
  const auto found = by_name_.find(device);
  return found == by_name_.end() ? nullptr : &devices_[found->second];
}

// Returns a time that is never the same twice, so that a metric has one value at one time. A clock
// that was set back is followed.
std::uint64_t EdgeNode::now_ms() {
  const std::uint64_t now = system_ms();
  const bool again = now <= last_ms_ && last_ms_ - now < 1000;
  last_ms_ = again ? last_ms_ + 1 : now;
  return last_ms_;
}

}  // namespace loopwarden::edge
