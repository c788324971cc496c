// SPDX-License-Identifier: Apache-2.0
// Finds the owner of a link, because two masters must not use the same link.
#pragma once

#include <filesystem>
#include <string>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::daemon::probe {

// Returns why a link must not be used; empty: it may be used. A link is in use by a loop of the
// running daemon or by its server for masters. It also counts as in use if that daemon does not
// answer. `folder`: configuration of the daemon, for the place of its sockets; it may be missing.
std::string owner_of(const hal::modbus::LinkSettings& link, const std::filesystem::path& folder);

}  // namespace loopwarden::daemon::probe
