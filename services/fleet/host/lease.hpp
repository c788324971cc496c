// SPDX-License-Identifier: Apache-2.0
// Leases decide which of several host processes serves a group. An owner renews its lease. A lease
// is free kLeaseSeconds after its last renewal. Only the database's clock counts.
//
// Each host also announces itself and the groups that it may serve, so that groups are shared
// evenly. The host with the fewest groups takes a free one. A host that has two more than another
// host gives one up (FleetHost).
#pragma once

#include <map>
#include <string>
#include <vector>

#include <pqxx/pqxx>

namespace loopwarden::fleet {

inline constexpr int kLeaseSeconds = 6;
inline constexpr int kRenewSeconds = 2;  // a lost owner is replaced within 10 s

// Announces that `owner` is alive and may serve `groups`. Returns, for each group that other live
// hosts may serve, the smallest number of leases among those hosts. Throws pqxx's exceptions, as do
// all functions here.
std::map<std::string, int> announce(pqxx::connection& connection, const std::string& owner,
                                    const std::vector<std::string>& groups);

// Takes or renews the lease of `group`. Returns false if another owner has it.
bool hold_lease(pqxx::connection& connection, const std::string& group, const std::string& owner);
// Releases the lease at once, so that another process need not wait. A lease of another owner is
// not changed.
void release_lease(pqxx::connection& connection, const std::string& group,
                   const std::string& owner);
// Removes the announcement of `owner` and releases all its leases.
void withdraw(pqxx::connection& connection, const std::string& owner);

}  // namespace loopwarden::fleet
