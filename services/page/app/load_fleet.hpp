// SPDX-License-Identifier: Apache-2.0
// Loads the queries of the plant's database. They are a module of the package loopwarden-fleet,
// because they need PostgreSQL's client library, which no other box needs.
#pragma once

#include <memory>

#include "services/database/database_settings.hpp"
#include "services/page/fleet/fleet.hpp"

namespace loopwarden::fleet {

// Throws std::runtime_error if the module is missing; the text names the package.
std::unique_ptr<Fleet> load_fleet(const DatabaseSettings& settings);

}  // namespace loopwarden::fleet
