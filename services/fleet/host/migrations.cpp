// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/migrations.hpp"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

namespace loopwarden::fleet {
namespace {

constexpr const char* kLock =
    "SELECT pg_advisory_xact_lock(hashtext('loopwarden-fleet migrations'))";

}  // namespace

int migrate(pqxx::connection& connection) {
  const std::array all{kMigration0001, kMigration0002, kMigration0003,
                       kMigration0004, kMigration0005, kMigration0006,
                       kMigration0007, kMigration0008, kMigration0009};
  const int wanted = static_cast<int>(all.size());
  pqxx::work work(connection);
  work.exec(kLock);
  work.exec(
      "CREATE TABLE IF NOT EXISTS migration(number integer PRIMARY KEY, applied timestamptz "
      "DEFAULT now())");
  const int present = work.exec1("SELECT coalesce(max(number), 0) FROM migration")[0].as<int>();
  if (present > wanted) {
    throw std::runtime_error(fmt::format(
        "the database has migration {}, but this program knows only {}; use the newer program",
        present, wanted));
  }
  for (int number = present; number < wanted; ++number) {
    work.exec(all[static_cast<std::size_t>(number)]);
    work.exec_params("INSERT INTO migration(number) VALUES($1)", number + 1);
  }
  work.commit();
  return wanted - present;
}

}  // namespace loopwarden::fleet
