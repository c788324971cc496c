// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopwarden::daemon::host {

// Returns the units loopwarden-*.service that have failed or wait for a restart after a failure, as
// reported by systemd; nullopt if systemd can't be asked.
std::optional<std::vector<std::string>> failed_services();

// Returns true if systemd runs and /etc has the file of at least one service.
bool services_are_configured();

}  // namespace loopwarden::daemon::host
