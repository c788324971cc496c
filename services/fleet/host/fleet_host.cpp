// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/fleet_host.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "services/fleet/host/lease.hpp"
#include "services/fleet/host/maintenance.hpp"
#include "services/fleet/host/metrics_server.hpp"
#include "services/fleet/host/migrations.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"

namespace loopwarden::fleet {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr seconds kBetweenPartitions{600};
constexpr seconds kBetweenDecimations{5};
constexpr int kMostDecimations = 50;  // quarters of an hour of an edge, per call
constexpr std::chrono::milliseconds kUpkeepTick{500};
constexpr seconds kBetweenAttempts{2};
constexpr const char* kAllGroups = "*";

void log_lost(const char* what, const std::exception& e) {
  const std::string why = e.what();
  spdlog::warn("{}: {}", what, why.substr(0, why.find('\n')));
}

// Returns host name and process for readers of the table. Containers may share both.
std::string owner_name() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return fmt::format("{}:{}:{:08x}", host.data(), ::getpid(), std::random_device{}());
}

std::string lease_name(const GroupHost& group) {
  return group.group().empty() ? kAllGroups : group.group();
}

GroupSettings settings_of(const HostConfig& config, const std::string& group) {
  mqtt::ClientSettings client;
  client.broker = *config.broker;
  client.user = config.user;
  client.password = config.password;
  client.ca_file = config.ca_file;
  client.certificate_file = config.certificate_file;
  client.key = config.key;
  client.keep_alive = std::chrono::seconds(10);
  client.reconnect_max = std::chrono::milliseconds(5000);
  client.most_waiting = 1000;
  const std::string folder = group.empty() ? kAllGroups : group;
  return {.link = {std::move(client), group, host_id_of(config, group)},
          .spool = {.folder = config.state_directory / "spool" / folder,
                    .limit_bytes = config.spool_bytes},
          .database = config.database,
          .writer = config.writer,
          .tracker = config.tracker};
}

}  // namespace

FleetHost::FleetHost(HostConfig config) : config_(std::move(config)), owner_(owner_name()) {}

FleetHost::~FleetHost() { quit_ = true; }

std::string FleetHost::metrics() const {
  std::vector<GroupStatus> groups;
  groups.reserve(groups_.size());
  for (const auto& group : groups_) groups.push_back(group->status());
  return metrics_text(groups);
}

int FleetHost::run() {
  hold_leases();  // creates the tables if the database can be reached
  const std::vector<std::string> names =
      config_.groups.empty() ? std::vector<std::string>{""} : config_.groups;
  for (const std::string& name : names) {
    groups_.push_back(std::make_unique<GroupHost>(settings_of(config_, name)));
  }
  const MetricsServer& wanted = config_.metrics;
  std::optional<MetricsEndpoint> endpoint;
  if (wanted.port != 0) {
    endpoint.emplace(wanted.address, wanted.port, [this] { return metrics(); });
  }
  maintenance_.start({.name = "lw-upkeep", .stack_bytes = 1024UL * 1024UL}, [this] { maintain(); });
  sd_notify(0, "READY=1");
  do {
    hold_leases();
    sd_notify(0, "WATCHDOG=1");
  } while (base::wait_for_signal({SIGTERM, SIGINT}, seconds(kRenewSeconds)) == 0);
  sd_notify(0, "STOPPING=1");
  quit_ = true;
  for (const auto& group : groups_) group->stop();
  withdraw_leases();
  maintenance_.join();
  return kExitOk;
}

void FleetHost::prepare_database() {
  if (!leases_) leases_ = open_database(config_.database);
  if (schema_ready_) return;
  const int applied = migrate(*leases_);
  if (applied > 0) spdlog::info("database: {} migrations applied", applied);
  keep_partitions(*leases_, config_.retention);
  schema_ready_ = true;
}

// While the database can't be reached, all owners keep their groups: no other process can take a
// lease.
void FleetHost::hold_leases() {
  try {
    prepare_database();
    std::vector<std::string> names;
    for (const auto& group : groups_) names.push_back(lease_name(*group));
    const std::map<std::string, int> fewest = announce(*leases_, owner_, names);
    for (const auto& group : groups_) renew(*group, fewest);
    share(fewest);
  } catch (const std::exception& e) {
    log_lost("database", e);
    leases_.reset();
  }
}

void FleetHost::renew(GroupHost& group, const std::map<std::string, int>& fewest) {
  const std::string name = lease_name(group);
  if (group.handed_over()) {
    release_lease(*leases_, name, owner_);
    spdlog::info("group {}: handed over to another host", name);
    return group.own(false);
  }
  const bool had = group.owned() || group.handing_over();
  const auto other = fewest.find(name);
  if (!had && other != fewest.end() && other->second < served()) return;
  const bool mine = hold_lease(*leases_, name, owner_);
  if (mine == had) return;
  spdlog::info("group {}: {}", name, mine ? "served from now on" : "another host has it");
  group.own(mine);
}

// Gives up one lease at a time, so that each host sees the effect of the last change.
void FleetHost::share(const std::map<std::string, int>& fewest) {
  for (const auto& group : groups_) {
    if (group->handing_over()) return;
  }
  for (auto group = groups_.rbegin(); group != groups_.rend(); ++group) {
    const auto other = fewest.find(lease_name(**group));
    if (!(*group)->owned() || other == fewest.end() || other->second + 2 > served()) continue;
    if ((*group)->behind()) continue;
    spdlog::info("group {}: to be handed over to another host, which has fewer groups",
                 lease_name(**group));
    return (*group)->hand_over();
  }
}

int FleetHost::served() const {
  return static_cast<int>(
      std::count_if(groups_.begin(), groups_.end(), [](const auto& g) { return g->owned(); }));
}

void FleetHost::withdraw_leases() {
  try {
    if (leases_) withdraw(*leases_, owner_);
  } catch (const std::exception& e) {
    log_lost("leases", e);  // leases expire without it
  }
}

// Maintenance uses its own connection and thread, so that leases and values never wait for it.
void FleetHost::maintain() {
  std::unique_ptr<pqxx::connection> connection;
  steady_clock::time_point partitions = steady_clock::now();
  steady_clock::time_point decimation{};
  while (!quit_) {
    std::this_thread::sleep_for(kUpkeepTick);
    if (!schema_ready_) continue;
    try {
      if (!connection) connection = open_database(config_.database);
      const auto now = steady_clock::now();
      if (now - partitions >= kBetweenPartitions) {
        keep_partitions(*connection, config_.retention);
        partitions = now;
      }
      ask_what_is_due(*connection);
      if (now - decimation < kBetweenDecimations) continue;
      decimate(*connection);
      decimation = now;
    } catch (const std::exception& e) {
      log_lost("upkeep", e);
      connection.reset();
      std::this_thread::sleep_for(kBetweenAttempts);
    }
  }
}

void FleetHost::ask_what_is_due(pqxx::connection& connection) {
  for (const auto& group : groups_) {
    if (!group->owned()) continue;
    ask_due_requests(connection, group->group(),
                     [&group](const DueRequest& request) { return group->ask(request); });
  }
}

void FleetHost::decimate(pqxx::connection& connection) {
  for (const auto& group : groups_) {
    if (group->owned()) decimate_history(connection, group->group(), kMostDecimations);
  }
}

}  // namespace loopwarden::fleet
