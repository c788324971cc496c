// SPDX-License-Identifier: Apache-2.0
// Everything that serves one group: its connection to the broker, its spool, and the thread that takes from the spool
// into the database.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <pqxx/pqxx>

#include "services/fleet/host/broker_link.hpp"
#include "services/database/connection.hpp"
#include "services/fleet/host/ingest.hpp"
#include "services/fleet/host/maintenance.hpp"
#include "services/fleet/host/spool.hpp"
#include "services/fleet/host/status.hpp"
#include "services/fleet/host/writer.hpp"
#include "base/limited_log.hpp"
#include "base/thread.hpp"

namespace loopwarden::fleet {

struct GroupSettings {
  LinkSettings link;
  SpoolSettings spool;
  DatabaseSettings database;
  WriterSettings writer;
  TrackerSettings tracker;
};

class GroupHost {
 public:
  // Begins with what an earlier run left in the spool; serves nobody yet.
  explicit GroupHost(GroupSettings settings);
  GroupHost(const GroupHost&) = delete;
  GroupHost& operator=(const GroupHost&) = delete;
  ~GroupHost();

  const std::string& group() const noexcept { return settings_.link.group; }
  bool owned() const noexcept { return owned_; }
  void own(bool owned);
  // Says goodbye at the broker and writes what is there: another host is to have the group. Ends with own().
  void hand_over();
  bool handing_over() const noexcept { return handing_over_; }
  bool handed_over() const { return handing_over_ && link_.gone() && spool_.waiting() == 0; }
  // There is more to write than a moment takes.
  bool behind() const { return spool_.disk_bytes() > 0; }
  // Asks a box for something (DCMD, or NCMD for the box itself). False: it can't go out now.
  bool ask(const DueRequest& request);
  // Says goodbye at the broker, writes what is there if the database lets it at once, else leaves it in the spool.
  void stop();

  GroupStatus status() const;

 private:
  void run();
  bool connect_database();
  void step();
  void enter_live_phase();
  void write(std::vector<Arrival> arrivals);
  void written(Batch batch, const Written& written, double seconds);
  void database_lost(const std::string& why);
  bool refused(const pqxx::sql_error& error, const std::vector<Arrival>& arrivals);
  void steer_edges();
  void pause(std::chrono::milliseconds patience);
  void ask_rebirth(const EdgeName& edge);

  const GroupSettings settings_;
  Spool spool_;
  BrokerLink link_;
  std::atomic<bool> owned_{false};
  std::atomic<bool> handing_over_{false};
  std::atomic<bool> forget_births_{false};
  std::atomic<bool> quit_{false};

  // Of the thread.
  std::unique_ptr<pqxx::connection> connection_;
  Ingest ingest_;
  base::LimitedLog log_;
  bool left_over_phase_;  // what an earlier run left is written first
  bool restored_ = false;
  std::size_t most_ = kMostMessages;
  std::chrono::milliseconds wait_{0};  // before the next attempt at the database
  std::chrono::steady_clock::time_point synced_{};
  static constexpr std::size_t kMostMessages = 5000;  // of a transaction

  mutable std::mutex mutex_;  // of status_
  GroupStatus status_;
  std::mutex pause_mutex_;
  std::condition_variable wake_;
  base::Thread thread_;
};

}  // namespace loopwarden::fleet
