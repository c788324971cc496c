// SPDX-License-Identifier: Apache-2.0
// Connections to PostgreSQL that a dead network can't hold for long.
#pragma once

#include <memory>

#include <pqxx/pqxx>

#include "services/database/database_settings.hpp"

namespace loopwarden::fleet {

struct Purpose {
  const char* program;  // as pg_stat_activity shows it
  int statement_seconds = 60;
  bool read_only = false;  // and its queries are not worth compiling (jit)
};
inline constexpr Purpose kForHost{.program = "loopwarden-fleet"};

// Throws std::exception: what it says is for the log, and holds no password. A connection attempt takes at most 5 s; a
// peer that vanished is noticed within 15 s, a statement ends within `statement_seconds`. Any thread.
std::unique_ptr<pqxx::connection> open_database(const DatabaseSettings& settings,
                                                const Purpose& purpose = kForHost);

}  // namespace loopwarden::fleet
