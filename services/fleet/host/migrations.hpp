// SPDX-License-Identifier: Apache-2.0
// The numbered migrations (services/fleet/host/migrations). Each is applied once, in order.
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

// Migrates the schema to this program's version, in one transaction under an advisory lock. If
// several programs start at once, one migrates and the others wait. Returns the number of applied
// migrations. Throws std::runtime_error if a newer program has migrated the database; also pqxx's
// exceptions.
int migrate(pqxx::connection& connection);

}  // namespace loopwarden::fleet
