// SPDX-License-Identifier: Apache-2.0
// Serves one group: the connection to its broker, its spool, and the thread that writes from the
// spool to the database.
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
  // Starts with the messages that an earlier run left in the spool. It does not serve the group
  // yet.
  explicit GroupHost(GroupSettings settings);
  GroupHost(const GroupHost&) = delete;
  GroupHost& operator=(const GroupHost&) = delete;
  ~GroupHost();

  const std::string& group() const noexcept { return settings_.link.group; }
  bool owned() const noexcept { return owned_; }
  void own(bool owned);
  // Publishes the offline state and writes the remaining messages, because another host is to have
  // the group. own() ends this state.
  void hand_over();
  bool handing_over() const noexcept { return handing_over_; }
  bool handed_over() const { return handing_over_ && link_.gone() && spool_.waiting() == 0; }
  // Returns whether more messages wait than are written in a moment.
  bool behind() const { return spool_.disk_bytes() > 0; }
  // Sends a request to a box (DCMD, or NCMD for the box itself). Returns false if it can't be sent
  // now.
  bool ask(const DueRequest& request);
  // Publishes the offline state. Writes the remaining messages if the database accepts them at
  // once; otherwise they stay in the spool.
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

  // For the thread only.
  std::unique_ptr<pqxx::connection> connection_;
  Ingest ingest_;
  base::LimitedLog log_;
  bool left_over_phase_;  // messages of an earlier run are written first
  bool restored_ = false;
  std::size_t most_ = kMostMessages;
  std::chrono::milliseconds wait_{0};  // until the next attempt at the database
  std::chrono::steady_clock::time_point synced_{};
  static constexpr std::size_t kMostMessages = 5000;  // per transaction

  mutable std::mutex mutex_;  // guards status_
  GroupStatus status_;
  std::mutex pause_mutex_;
  std::condition_variable wake_;
  base::Thread thread_;
};

}  // namespace loopwarden::fleet
