// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/group_host.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::fleet {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Collects messages for this time into one transaction, because the cost per transaction dominates.
constexpr milliseconds kBetweenCommits{100};
constexpr milliseconds kLongestWait{5000};
constexpr milliseconds kBetweenSyncs{1000};
constexpr const char* kTimeout =
    "57014";  // statement time-out; a retry with fewer messages may finish in time
// Fill of the spool above which edges must store values, and below which they send again.
constexpr double kFull = 0.8;
constexpr double kRoomAgain = 0.5;

mqtt::Message command(const EdgeName& edge, const std::string& device, const std::string& name,
                      sparkplug::DataType type, sparkplug::Value value) {
  const auto kind = device.empty() ? sparkplug::MessageType::ncmd : sparkplug::MessageType::dcmd;
  const auto now = static_cast<std::uint64_t>(base::utc_ms());
  sparkplug::Metric metric;
  metric.name = name;
  metric.time_ms = now;
  metric.type = type;
  metric.value = std::move(value);
  const sparkplug::Payload payload{
      .time_ms = now, .seq = std::nullopt, .metrics = {std::move(metric)}};
  return {.topic = to_text(sparkplug::Topic{edge.group, kind, edge.edge, device}),
          .payload = encode(payload, sparkplug::Types::sent),
          .qos = mqtt::Qos::at_most_once,
          .retain = false};
}

// Returns whether the data caused the error, so that each retry would fail. Examples are bad data,
// a broken constraint, and a value that is too long for an index.
bool is_of_the_data(const pqxx::sql_error& error) {
  const std::string kind = error.sqlstate().substr(0, 2);
  return kind == "22" || kind == "23" || kind == "54";
}

}  // namespace

GroupHost::GroupHost(GroupSettings settings)
    : settings_(std::move(settings)),
      spool_(settings_.spool),
      link_(settings_.link, spool_),
      ingest_(settings_.tracker),
      left_over_phase_(!spool_.empty()) {
  status_.group = group();
  thread_.start({.name = "lw-ingest", .stack_bytes = 1024UL * 1024UL}, [this] { run(); });
}

GroupHost::~GroupHost() { stop(); }

void GroupHost::own(bool owned) {
  // Another host may have had the group meanwhile, so the edges' births are unknown.
  if (owned && !owned_) forget_births_ = true;
  handing_over_ = false;
  owned_ = owned;
  link_.own(owned);
}

void GroupHost::hand_over() {
  link_.leave();
  owned_ = false;
  handing_over_ = true;
}

bool GroupHost::ask(const DueRequest& request) {
  return link_.send(command({request.group, request.edge}, request.device, request.metric,
                            sparkplug::DataType::string, request.value));
}

void GroupHost::ask_rebirth(const EdgeName& edge) {
  const bool sent =
      link_.send(command(edge, "", "Node Control/Rebirth", sparkplug::DataType::boolean, true));
  const std::string name = edge.group + '/' + edge.edge;
  if (sent) {
    log_.info(name, "asked", name + ": a rebirth is asked for");
  } else {
    log_.warn(name, "not asked",
              name + ": a rebirth is needed, but the broker accepts no message now");
  }
}

void GroupHost::stop() {
  link_.stop();
  {
    const std::lock_guard lock(pause_mutex_);
    quit_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

GroupStatus GroupHost::status() const {
  const std::lock_guard lock(mutex_);
  GroupStatus status = status_;
  status.owned = owned_;
  status.broker_connected = link_.connected();
  status.broker_connections = link_.connections();
  status.spool_messages = spool_.waiting();
  status.spool_bytes = spool_.disk_bytes();
  status.spool_dropped = spool_.dropped();
  return status;
}

void GroupHost::run() {
  while (!quit_) {
    const auto begin = steady_clock::now();
    if (connect_database()) step();
    steer_edges();
    log_.look();
    if (wait_ > milliseconds(0)) {
      pause(wait_);
    } else if (spool_.waiting() < kMostMessages) {
      const auto spent = std::chrono::duration_cast<milliseconds>(steady_clock::now() - begin);
      if (spent < kBetweenCommits) pause(kBetweenCommits - spent);
    }
  }
  // Writes the last messages if the database accepts them at once. Otherwise they stay on the disk.
  if (connection_ && wait_ == milliseconds(0)) step();
  spool_.to_disk();
  spool_.sync();
}

void GroupHost::pause(milliseconds patience) {
  std::unique_lock lock(pause_mutex_);
  wake_.wait_for(lock, patience, [this] { return quit_.load(); });
}

bool GroupHost::connect_database() {
  if (connection_) return true;
  try {
    connection_ = open_database(settings_.database);
    if (!restored_) restore(*connection_, group(), left_over_phase_, ingest_);
    restored_ = true;
    wait_ = milliseconds(0);
    const std::lock_guard lock(mutex_);
    status_.database_connected = true;
    return true;
  } catch (const std::exception& e) {
    database_lost(e.what());
    return false;
  }
}

void GroupHost::database_lost(const std::string& why) {
  log_.warn("database", "away",
            settings_.link.host_id + ": database: " + why.substr(0, why.find('\n')));
  connection_.reset();
  spool_.to_disk();
  wait_ = std::min(kLongestWait, std::max(milliseconds(250), 2 * wait_));
  const std::lock_guard lock(mutex_);
  status_.database_connected = false;
}

void GroupHost::steer_edges() {
  const auto now = steady_clock::now();
  if (now - synced_ >= kBetweenSyncs) {
    spool_.sync();
    synced_ = now;
  }
  const double fill = spool_.fill();
  const std::lock_guard lock(mutex_);
  if (fill > kFull) status_.accepting = false;
  if (fill < kRoomAgain) status_.accepting = true;
  link_.accept(status_.accepting);
}

void GroupHost::step() {
  try {
    if (forget_births_ && !left_over_phase_) {
      forget_births_ = false;
      ingest_.forget_births();
    }
    std::vector<Arrival> arrivals = spool_.peek(most_);
    if (left_over_phase_ && (arrivals.empty() || !arrivals.front().left_over)) enter_live_phase();
    write(std::move(arrivals));
  } catch (const std::exception& e) {
    database_lost(e.what());
  }
}

// The restored state of the edges served to write the messages of an earlier run. It is not valid
// for new messages.
void GroupHost::enter_live_phase() {
  left_over_phase_ = false;
  forget_births_ = false;
  ingest_ = Ingest(settings_.tracker);
  restore(*connection_, group(), false, ingest_);
}

void GroupHost::write(std::vector<Arrival> arrivals) {
  const auto begin = steady_clock::now();
  Batch batch = ingest_.prepare(arrivals, base::utc_ms());
  Written done;
  if (!batch.edges.empty()) {
    try {
      done = Writer(*connection_, settings_.writer).write(batch);
    } catch (const pqxx::sql_error& e) {
      if (e.sqlstate() == kTimeout) most_ = std::max<std::size_t>(1, arrivals.size() / 2);
      if (!is_of_the_data(e)) throw;
      if (!refused(e, arrivals)) return;
      batch = {};
    }
  }
  spool_.pop();
  most_ = std::min(kMostMessages, most_ * 2);
  if (arrivals.empty() && batch.edges.empty()) return;
  written(std::move(batch), done,
          std::chrono::duration<double>(steady_clock::now() - begin).count());
}

// Halves the number of messages for the next attempt. Returns true if a single message was refused;
// that message is dropped.
bool GroupHost::refused(const pqxx::sql_error& error, const std::vector<Arrival>& arrivals) {
  if (arrivals.size() > 1) {
    most_ = arrivals.size() / 2;
    return false;
  }
  spdlog::error("{}: dropped, the database refuses it: {}",
                arrivals.empty() ? "a message" : arrivals.front().topic, error.what());
  const std::lock_guard lock(mutex_);
  ++status_.rejected;
  return true;
}

void GroupHost::written(Batch batch, const Written& done, double seconds) {
  const double now_s = static_cast<double>(base::utc_ms()) / 1e3;
  for (const EdgeName& edge : batch.ask_rebirth) ask_rebirth(edge);
  for (const EdgeName& edge : batch.conflicts) {
    spdlog::warn("{}/{}: two edge nodes seem to have this name", edge.group, edge.edge);
  }
  const std::lock_guard lock(mutex_);
  for (const std::int64_t time_ms : batch.times_ms) {
    status_.delay.add(now_s - static_cast<double>(time_ms) / 1e3);
  }
  ingest_.commit(std::move(batch));
  status_.counts = ingest_.counts();
  status_.values_written += done.values;
  status_.values_duplicate += done.duplicates;
  ++status_.commits;
  status_.commit_s += seconds;
  status_.edges = ingest_.edges().size();
  status_.edges_online = static_cast<std::uint64_t>(
      std::count_if(ingest_.edges().begin(), ingest_.edges().end(),
                    [](const auto& edge) { return edge.second.tracker.born(); }));
}

}  // namespace loopwarden::fleet
