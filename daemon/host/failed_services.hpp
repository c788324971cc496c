// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopwarden::daemon::host {

// Returns the failed units loopwarden-*.service as reported by systemd; nullopt if systemd can't be
// asked.
std::optional<std::vector<std::string>> failed_services();

}  // namespace loopwarden::daemon::host
