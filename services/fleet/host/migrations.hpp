// SPDX-License-Identifier: Apache-2.0
// The numbered migrations (services/fleet/host/migrations), each applied once, in order.
#pragma once

#include <pqxx/pqxx>

namespace loopwarden::fleet {

extern const char* const kMigration0001;
extern const char* const kMigration0002;
extern const char* const kMigration0003;
extern const char* const kMigration0004;
extern const char* const kMigration0005;
extern const char* const kMigration0006;
extern const char* const kMigration0007;
extern const char* const kMigration0008;
extern const char* const kMigration0009;

// Brings the schema up to what this program needs, in one transaction under an advisory lock, so that of several
// programs that begin at once one does it and the others wait. Returns how many were applied. Throws
// std::runtime_error where the database is of a newer program; pqxx's exceptions.
int migrate(pqxx::connection& connection);

}  // namespace loopwarden::fleet
