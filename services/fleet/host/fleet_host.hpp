// SPDX-License-Identifier: Apache-2.0
// The host process: one GroupHost per group, the leases that assign groups to hosts, and
// maintenance of the database.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <pqxx/pqxx>

#include "services/fleet/host/group_host.hpp"
#include "services/fleet/host/host_config.hpp"
#include "base/thread.hpp"

namespace loopwarden::fleet {

class FleetHost {
 public:
  explicit FleetHost(HostConfig config);
  FleetHost(const FleetHost&) = delete;
  FleetHost& operator=(const FleetHost&) = delete;
  ~FleetHost();

  // Serves until SIGTERM or SIGINT. Both must be blocked in all threads. Returns the exit code.
  int run();

  std::string metrics() const;

 private:
  void prepare_database();
  void hold_leases();
  void renew(GroupHost& group, const std::map<std::string, int>& fewest);
  void share(const std::map<std::string, int>& fewest);
  int served() const;
  void withdraw_leases();
  void maintain();
  void ask_what_is_due(pqxx::connection& connection);
  void decimate(pqxx::connection& connection);

  const HostConfig config_;
  const std::string owner_;
  std::vector<std::unique_ptr<GroupHost>> groups_;
  std::unique_ptr<pqxx::connection> leases_;  // for the main thread only
  std::atomic<bool> schema_ready_{false};
  std::atomic<bool> quit_{false};
  base::Thread maintenance_;
};

}  // namespace loopwarden::fleet
