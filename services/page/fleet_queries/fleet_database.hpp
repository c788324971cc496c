// SPDX-License-Identifier: Apache-2.0
// Answers queries from the plant's database, read-only.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <pqxx/pqxx>

#include "services/database/database_settings.hpp"
#include "services/page/fleet_queries/answer_cache.hpp"
#include "services/page/fleet/fleet.hpp"
#include "services/page/fleet_queries/fleet_queries.hpp"

namespace loopwarden::fleet {

// Thread-safe. It has one connection, which it opens at the first query and again after a loss. One
// query runs at a time, for at most 20 s. Slowly changing data (curves, versions, alarm rates and
// figures) are queried less often than active alarms.
class FleetDatabase final : public Fleet {
 public:
  explicit FleetDatabase(DatabaseSettings settings, CacheLimits limits = {});

  std::shared_ptr<const std::string> overview(const std::string& group) override;
  std::shared_ptr<const std::string> last_overview(const std::string& group) override;
  std::shared_ptr<const std::string> valve(const ValveName& name) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Slow {
    nlohmann::json what;
    Clock::time_point made;
  };
  struct Curve {
    std::vector<double> severity;
    Clock::time_point made;
  };

  AnswerCache::Answer make_overview(const std::string& group);
  AnswerCache::Answer make_valve(const ValveName& name);
  // Calls `ask` with the connection. Any error closes the connection and becomes FleetDown.
  nlohmann::json asked(const std::function<nlohmann::json(pqxx::transaction_base&)>& ask);
  void add_curves(pqxx::transaction_base& database, nlohmann::json& valves, std::int64_t now_ms);
  const nlohmann::json& versions(pqxx::transaction_base& database, const std::string& group);
  const nlohmann::json& figures(pqxx::transaction_base& database, const std::string& group,
                                std::int64_t now_ms);
  const nlohmann::json& rates(pqxx::transaction_base& database, std::int64_t now_ms);

  DatabaseSettings settings_;
  AnswerCache overviews_;
  AnswerCache valves_;
  std::mutex mutex_;  // guards the members below
  std::unique_ptr<pqxx::connection> connection_;
  std::map<AlarmName, Curve> curves_;
  std::map<std::string, Slow> versions_;  // by group
  std::map<std::string, Slow> figures_;   // by group
  std::vector<RaisedRow> raised_;
  nlohmann::json rates_;
  std::int64_t rates_until_ = 0;  // bin
};

}  // namespace loopwarden::fleet
