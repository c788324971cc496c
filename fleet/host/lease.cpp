// SPDX-License-Identifier: Apache-2.0
#include "fleet/host/lease.hpp"

namespace loopwarden::fleet {

bool hold_lease(pqxx::connection& connection, const std::string& group, const std::string& owner) {
  pqxx::work work(connection);
  const pqxx::result result = work.exec_params(
      "INSERT INTO lease AS l VALUES($1, $2, clock_timestamp() + $3 * interval '1 second') "
      "ON CONFLICT (group_name) DO UPDATE SET owner = excluded.owner, until = excluded.until "
      "WHERE l.owner = excluded.owner OR l.until < clock_timestamp() RETURNING 1",
      group, owner, kLeaseSeconds);
  work.commit();
  return !result.empty();
}

void release_lease(pqxx::connection& connection, const std::string& group,
                   const std::string& owner) {
  pqxx::work work(connection);
  work.exec_params("DELETE FROM lease WHERE group_name = $1 AND owner = $2", group, owner);
  work.commit();
}

}  // namespace loopwarden::fleet
