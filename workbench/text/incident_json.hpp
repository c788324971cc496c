// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "model/alarm/loop_incident.hpp"

namespace loopwarden::workbench {

// Returns an incident of a record, with times in the record's time: id, from_s, raised_s, name,
// cause, confidence, alarms, renamed, cleared_s.
nlohmann::json incident_json(const alarm::Incident& incident, const std::string& tag);
// Returns the same in one line.
std::string incident_text(const nlohmann::json& incident);

}  // namespace loopwarden::workbench
