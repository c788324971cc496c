// SPDX-License-Identifier: Apache-2.0
// Queries on the host's database (docs/reference/fleet-tables.md), with answers as JSON. A column's
// name is its key. Lists are bounded: {"all": total number, "list": [the worst entries]}. All throw
// pqxx's exceptions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <pqxx/pqxx>

#include "services/page/fleet_queries/alarm_rate.hpp"
#include "services/page/fleet/fleet.hpp"

namespace loopwarden::fleet {

inline constexpr int kMostValves = 200;
inline constexpr int kMostBoxes = 500;

// Steps of equal length. The last one starts at most one step before `now_ms`.
struct StepSpan {
  std::int64_t step_s = 0;
  std::int64_t steps = 0;
  std::int64_t from_s(std::int64_t now_ms) const noexcept {
    return (now_ms / 1000 / step_s - steps + 1) * step_s;
  }
};
inline constexpr StepSpan kWeeksOfList{.step_s = 86'400, .steps = 56};
inline constexpr StepSpan kWeeksOfValve{.step_s = 21'600, .steps = 364};

std::int64_t now_ms(pqxx::transaction_base& database);
nlohmann::json groups(pqxx::transaction_base& database);

// Returns the worst valves of one group, or of all (empty).
nlohmann::json worst_valves(pqxx::transaction_base& database, const std::string& group);
// Returns loops with active process alarms, newest first.
nlohmann::json faulty_loops(pqxx::transaction_base& database, const std::string& group);
nlohmann::json silent_boxes(pqxx::transaction_base& database, const std::string& group);
nlohmann::json different_boxes(pqxx::transaction_base& database, const std::string& group);
// Returns the most frequent versions in each group.
nlohmann::json usual_versions(pqxx::transaction_base& database);

// Returns the alarm figures of the last day (model/alarm/alarm_figures.hpp) for one group, or for
// all (empty).
nlohmann::json day_figures(pqxx::transaction_base& database, const std::string& group,
                           std::int64_t now_ms);

// Returns the number of alarms by group and bin of 10 minutes. Bins are numbered from 1970.
std::vector<RaisedRow> raised_between(pqxx::transaction_base& database, std::int64_t from_s,
                                      std::int64_t until_s);

// Returns the severity of alarms over time, one curve per entry of `alarms`.
struct AlarmName {
  int device_id = 0;
  std::string alarm;
  auto operator<=>(const AlarmName&) const = default;
};
std::vector<std::vector<double>> severity_curves(pqxx::transaction_base& database,
                                                 const std::vector<AlarmName>& alarms,
                                                 const StepSpan& span, std::int64_t now_ms);

// Returns nullopt if the valve does not exist.
std::optional<nlohmann::json> valve(pqxx::transaction_base& database, const ValveName& name);

// Values that are not finite become null.
nlohmann::json numbers_json(const std::vector<double>& values);

}  // namespace loopwarden::fleet
