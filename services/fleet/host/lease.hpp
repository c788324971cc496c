// SPDX-License-Identifier: Apache-2.0
// Who of several host processes serves a group. A lease is kept alive by its owner and free kLeaseSeconds after the
// owner's last sign; only the database's clock counts.
//
// Each host also says that it is there and which groups it may serve, so that groups are shared evenly: a free one is
// for the host that has the fewest, and a host with two more than another one gives one up (FleetHost).
#pragma once

#include <map>
#include <string>
#include <vector>

#include <pqxx/pqxx>

namespace loopwarden::fleet {

inline constexpr int kLeaseSeconds = 6;
inline constexpr int kRenewSeconds = 2;  // so that a lost owner is replaced within 10 s

// `owner` is there and may serve `groups`. Of each group that other hosts which are there may serve: how many leases the
// one of them has that has the fewest. Throws pqxx's exceptions, as all of these.
std::map<std::string, int> announce(pqxx::connection& connection, const std::string& owner,
                                    const std::vector<std::string>& groups);

// Takes or keeps the lease of `group`; false: another owner has it.
bool hold_lease(pqxx::connection& connection, const std::string& group, const std::string& owner);
// So that another process need not wait. Of another owner's it is left as it is.
void release_lease(pqxx::connection& connection, const std::string& group,
                   const std::string& owner);
// `owner` is no longer there; all its leases are free.
void withdraw(pqxx::connection& connection, const std::string& owner);

}  // namespace loopwarden::fleet
