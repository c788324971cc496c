// SPDX-License-Identifier: Apache-2.0
// Opens connections to PostgreSQL that a dead network can't block for long.
#pragma once

#include <memory>

#include <pqxx/pqxx>

#include "services/database/database_settings.hpp"

namespace loopwarden::fleet {

struct Purpose {
  const char* program;  // name in pg_stat_activity
  int statement_seconds = 60;
  // also disables the compilation of queries (jit), which does not pay off here
  bool read_only = false;
};
inline constexpr Purpose kForHost{.program = "loopwarden-fleet"};

// Opens a connection. A connection attempt takes at most 5 s. A vanished peer is detected within 15
// s. A statement ends within `statement_seconds`. From any thread. Throws std::exception; its text
// is for the log and contains no password.
std::unique_ptr<pqxx::connection> open_database(const DatabaseSettings& settings,
                                                const Purpose& purpose = kForHost);

}  // namespace loopwarden::fleet
