// SPDX-License-Identifier: Apache-2.0
// Who has a link already: no second master may work on it.
#pragma once

#include <filesystem>
#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::daemon::probe {

// Why a link must be left alone: a loop of the daemon that runs on these files, or its server for masters, has it, or it
// can't be told. Empty: nobody has it, or no daemon runs. `folder`: the daemon's configuration, which may not be there.
std::string owner_of(const hal::modbus::LinkSettings& link, const std::filesystem::path& folder);

}  // namespace loopwarden::daemon::probe
