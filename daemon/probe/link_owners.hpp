// SPDX-License-Identifier: Apache-2.0
// Who has a link already: no second master may work on it.
#pragma once

#include <filesystem>
#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::daemon::probe {

// Why a link must be left alone: a loop of the daemon that runs, or its server for masters, has it, or that daemon does not
// tell. Empty: neither has it, or no daemon runs. `folder`: its configuration, for the place of its sockets; it may not be
// there.
std::string owner_of(const hal::modbus::LinkSettings& link, const std::filesystem::path& folder);

}  // namespace loopwarden::daemon::probe
