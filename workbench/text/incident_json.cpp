// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/incident_json.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {

using nlohmann::json;

json incident_json(const alarm::Incident& incident, const std::string& tag) {
  const auto seconds = [](std::int64_t ms) { return static_cast<double>(ms) / 1000.0; };
  json alarms = json::array();
  for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
    if (incident.has(kind)) alarms.push_back(alarm::to_text(kind));
  }
  json renamed = json::array();
  for (const alarm::Incident::Renamed& one : incident.renamed) {
    renamed.push_back({{"time_s", seconds(one.at_ms)}, {"from", one.from}, {"to", one.to}});
  }
  return {{"id", fmt::format("{}-{:.1f}", tag, seconds(incident.opened_ms))},
          {"from_s", seconds(incident.from_ms)},
          {"raised_s", seconds(incident.opened_ms)},
          {"name", incident.name},
          {"cause", incident.cause ? effects::to_text(*incident.cause) : "unknown"},
          {"confidence", finite_or_null(incident.confidence)},
          {"alarms", std::move(alarms)},
          {"explanation", nullptr},
          {"renamed", std::move(renamed)},
          {"cleared_s", incident.open() ? json(nullptr) : json(seconds(incident.ended_ms))}};
}

std::string incident_text(const json& incident) {
  const json& sure = incident.at("confidence");
  std::string text = fmt::format(
      "incident {}: {} ({}{}), since {:.1f} s; alarms:", incident.at("id").get<std::string>(),
      incident.at("name").get<std::string>(), incident.at("cause").get<std::string>(),
      sure.is_null() ? "" : fmt::format(", confidence {:.2f}", sure.get<double>()),
      incident.at("from_s").get<double>());
  for (const json& alarm : incident.at("alarms")) text += " " + alarm.get<std::string>();
  for (const json& one : incident.at("renamed")) {
    text += fmt::format("; {:.1f} s: {} became {}", one.at("time_s").get<double>(),
                        one.at("from").get<std::string>(), one.at("to").get<std::string>());
  }
  const json& cleared = incident.at("cleared_s");
  return text + (cleared.is_null() ? "; not ended"
                                   : fmt::format("; ended at {:.1f} s", cleared.get<double>()));
}

}  // namespace loopwarden::workbench
