// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "model/monitor/loop_incident.hpp"

namespace loopwarden::daemon::journal {

// Returns FIC-205-20261124T145805Z: tag and UTC of the incident's start.
std::string incident_id(const std::string& tag, const loopwarden::monitor::Incident& incident);

// Convert an incident to a line of JSON, and back. Returns nullopt for invalid text.
std::string write_incident(const loopwarden::monitor::Incident& incident);
std::optional<loopwarden::monitor::Incident> read_incident(const std::string& text);

}  // namespace loopwarden::daemon::journal
