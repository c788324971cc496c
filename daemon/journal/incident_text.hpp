// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "model/alarm/loop_incident.hpp"

namespace loopwarden::daemon::journal {

// Returns FIC-205-20261124T145805Z: tag and UTC of the incident's start.
std::string incident_id(const std::string& tag, const alarm::Incident& incident);

// Convert an incident to a line of JSON, and back. Returns nullopt for invalid text.
std::string write_incident(const alarm::Incident& incident);
std::optional<alarm::Incident> read_incident(const std::string& text);

}  // namespace loopwarden::daemon::journal
