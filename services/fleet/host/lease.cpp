// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/lease.hpp"

#include "services/database/array_text.hpp"

namespace loopwarden::fleet {
namespace {

constexpr const char* kFewest = R"(
SELECT h.group_name, min(coalesce(l.leases, 0))
  FROM host h LEFT JOIN (SELECT owner, count(*) AS leases FROM lease WHERE until > clock_timestamp()
    GROUP BY owner) l
    USING(owner)
  WHERE h.owner <> $1 AND h.until > clock_timestamp() GROUP BY h.group_name)";

}  // namespace

std::map<std::string, int> announce(pqxx::connection& connection, const std::string& owner,
                                    const std::vector<std::string>& groups) {
  ArrayText names;
  for (const std::string& group : groups) names.add(group);
  pqxx::work work(connection);
  work.exec("DELETE FROM host WHERE until < clock_timestamp() - interval '1 minute'");
  work.exec_params(
      "INSERT INTO host SELECT $1, unnest($2::text[]), clock_timestamp() + $3 * interval '1 "
      "second' "
      "ON CONFLICT (owner, group_name) DO UPDATE SET until = excluded.until",
      owner, names.text(), kLeaseSeconds);
  std::map<std::string, int> fewest;
  for (const pqxx::row row : work.exec_params(kFewest, owner)) {
    fewest.emplace(row[0].as<std::string>(), row[1].as<int>());
  }
  work.commit();
  return fewest;
}

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

void withdraw(pqxx::connection& connection, const std::string& owner) {
  pqxx::work work(connection);
  work.exec_params("DELETE FROM host WHERE owner = $1", owner);
  work.exec_params("DELETE FROM lease WHERE owner = $1", owner);
  work.commit();
}

}  // namespace loopwarden::fleet
