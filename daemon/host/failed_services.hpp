// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopwarden::daemon::host {

// Units loopwarden-*.service that have failed, as systemd has it; nothing: it can't be asked.
std::optional<std::vector<std::string>> failed_services();

}  // namespace loopwarden::daemon::host
