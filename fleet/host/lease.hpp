// SPDX-License-Identifier: Apache-2.0
// Who of several host processes serves a group. A lease is kept alive by its owner and free kLeaseSeconds after the
// owner's last sign; only the database's clock counts.
#pragma once

#include <string>

#include <pqxx/pqxx>

namespace loopwarden::fleet {

inline constexpr int kLeaseSeconds = 6;
inline constexpr int kRenewSeconds = 2;  // so that a lost owner is replaced within 10 s

// Takes or keeps the lease of `group`; false: another owner has it. Throws pqxx's exceptions.
bool hold_lease(pqxx::connection& connection, const std::string& group, const std::string& owner);
// So that another process need not wait. Of another owner's it is left as it is.
void release_lease(pqxx::connection& connection, const std::string& group,
                   const std::string& owner);

}  // namespace loopwarden::fleet
