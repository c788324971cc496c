// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "workbench/text/commission_json.hpp"

#include <fmt/format.h>

#include "workbench/text/gap_json.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {

using nlohmann::json;

namespace {

bool is_share(twin::TwinSees change) {
  return change == twin::TwinSees::gain || change == twin::TwinSees::controller;
}

}  // namespace

json commission_json(const twin::Commissioning& made, const CommissionDetectability& all) {
  const twin::Detectability* detectability = all.specialists ? &*all.specialists : nullptr;
  json effects = json::array();
  json gap = nullptr;
  if (made.gap) {
    const json whole = gap_json(*made.gap);
    effects = whole.at("effects");
    gap = whole.at("gap");
    gap["closed"] = finite_or_null(made.closed);
    gap["steps"] = json::array();
    for (const twin::Stage& stage : made.stages) {
      gap["steps"].push_back({{"added", stage.name},
                              {"rmse", finite_or_null(stage.rmse)},
                              {"holdout_rmse", finite_or_null(stage.holdout_rmse)}});
    }
  }
  json detectable = nullptr;
  if (detectability != nullptr || !all.twin.empty()) detectable = json::object();
  for (const twin::TwinSeen& seen : all.twin) {
    const bool share = is_share(seen.change);
    detectable[to_text(seen.change)] = {
        {share ? "percent" : "seconds",
         seen.size ? json((share ? 100.0 : 1.0) * *seen.size) : json()},
        {"hours_to_alarm", seen.to_alarm_s ? json(*seen.to_alarm_s / 3600.0) : json()}};
  }
  if (detectability != nullptr) {
    for (const twin::Seen& seen : detectability->seen) {
      detectable[specialist::to_text(seen.condition)] = {
          {"percent_of_span", seen.percent_of_span ? json(*seen.percent_of_span) : json()},
          {"hours_to_alarm", seen.hours_to_alarm ? json(*seen.hours_to_alarm) : json()}};
    }
  }
  const bool good = made.outcome == twin::Outcome::commissioned;
  return {
      {"verdict", twin::to_text(made.outcome)},
      {"why", made.why},
      {"twin", good ? json("twin.yaml") : json()},
      {"specialists", detectability != nullptr ? json("specialists") : json()},
      {"effects", std::move(effects)},
      {"gap", std::move(gap)},
      {"detectable", std::move(detectable)},
      {"false_alarms", detectability != nullptr ? json(detectability->false_alarms) : json()},
      {"false_alarms_per_year",
       detectability != nullptr ? json(detectability->false_alarms_per_year) : json()},
      {"simulated_years", detectability != nullptr ? json(detectability->simulated_years) : json()},
      {"accepted", made.accepted},
      {"notes", made.notes}};
}

std::string seen_text(const twin::Seen& seen) {
  if (!seen.percent_of_span) {
    return fmt::format(
        "not reliable (detected in at most {:.0f} % of the windows). Use more and larger set-point "
        "moves",
        100.0 * seen.found_at_most);
  }
  return fmt::format("from {:.2g} % of span on, {}", *seen.percent_of_span,
                     seen.hours_to_alarm
                         ? fmt::format("alarm after {:.0f} min", 60.0 * *seen.hours_to_alarm)
                         : std::string("no alarm within two hours"));
}

std::string seen_text(const twin::TwinSeen& seen) {
  if (!seen.size) return "not reliable. Use larger set-point moves";
  return is_share(seen.change) ? fmt::format("from {:.0f} % on, alarm after {:.0f} min",
                                             100.0 * *seen.size, *seen.to_alarm_s / 60.0)
                               : fmt::format("from {:.2g} s on, alarm after {:.0f} min", *seen.size,
                                             *seen.to_alarm_s / 60.0);
}

}  // namespace loopwarden::workbench
