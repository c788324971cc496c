// SPDX-License-Identifier: Apache-2.0
// Connections to PostgreSQL that a dead network can't hold for long.
#pragma once

#include <memory>
#include <string>

#include <pqxx/pqxx>

#include "fleet/mqtt/secret.hpp"

namespace loopwarden::fleet {

struct DatabaseSettings {
  std::string url;  // postgresql://...
  mqtt::Secret password;
};

// Throws std::exception: what it says is for the log. A connection attempt takes at most 5 s; a peer that vanished is
// noticed within 15 s, a statement ends within a minute.
std::unique_ptr<pqxx::connection> open_database(const DatabaseSettings& settings);

}  // namespace loopwarden::fleet
