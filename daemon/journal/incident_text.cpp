// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/incident_text.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <nlohmann/json.hpp>

namespace loopwarden::daemon::journal {

using alarm::Incident;
using nlohmann::json;

std::string incident_id(const std::string& tag, const Incident& incident) {
  return fmt::format("{}-{:%Y%m%dT%H%M%S}Z", tag,
                     fmt::gmtime(static_cast<std::time_t>(incident.opened_ms / 1000)));
}

std::string write_incident(const Incident& incident) {
  json renamed = json::array();
  for (const Incident::Renamed& one : incident.renamed) {
    renamed.push_back({{"at_ms", one.at_ms}, {"from", one.from}, {"to", one.to}});
  }
  return json{{"opened_ms", incident.opened_ms},
              {"since_ms", incident.since_ms},
              {"from_ms", incident.from_ms},
              {"gone_ms", incident.gone_ms},
              {"ended_ms", incident.ended_ms},
              {"alarms", incident.alarms},
              {"name", incident.name},
              {"cause", incident.cause ? json(static_cast<int>(*incident.cause)) : json(nullptr)},
              {"confidence", incident.explained() ? json(incident.confidence) : json(nullptr)},
              {"renamed", std::move(renamed)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

std::optional<Incident> read_incident(const std::string& text) {
  try {
    const json j = json::parse(text);
    Incident incident;
    incident.opened_ms = j.at("opened_ms").get<std::int64_t>();
    incident.since_ms = j.value("since_ms", incident.opened_ms);  // missing in files up to 2026
    incident.from_ms = j.at("from_ms").get<std::int64_t>();
    incident.gone_ms = j.at("gone_ms").get<std::int64_t>();
    incident.ended_ms = j.at("ended_ms").get<std::int64_t>();
    incident.alarms = j.at("alarms").get<std::uint16_t>();
    incident.name = j.at("name").get<std::string>();
    if (const json& cause = j.at("cause"); !cause.is_null()) {
      if (cause.get<int>() < 0 ||
          cause.get<int>() > static_cast<int>(effects::Block::disturbance)) {
        return std::nullopt;
      }
      incident.cause = static_cast<effects::Block>(cause.get<int>());
    }
    if (const json& sure = j.at("confidence"); !sure.is_null()) {
      incident.confidence = sure.get<double>();
    }
    for (const json& one : j.at("renamed")) {
      incident.renamed.push_back({one.at("at_ms").get<std::int64_t>(),
                                  one.at("from").get<std::string>(),
                                  one.at("to").get<std::string>()});
    }
    return incident;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace loopwarden::daemon::journal
