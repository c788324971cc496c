// SPDX-License-Identifier: Apache-2.0
// Maintains the database while values are written: creates partitions in advance, drops old ones,
// decimates the history and sends requests that are due.
#pragma once

#include <functional>
#include <string>

#include <pqxx/pqxx>

namespace loopwarden::fleet {

struct Retention {
  int values_days = 31;  // all values
  int history_days =
      3 * 366;  // mean, low, high and last value per quarter of an hour; alarms and events too
  int evidence_days = 366;
};

inline constexpr int kPartitionDaysAhead = 3;

// Creates and drops partitions, and deletes old rows. If several processes call it, one does the
// work and the others return at once. Returns the number of dropped partitions.
int keep_partitions(pqxx::connection& connection, const Retention& retention);

// Decimates at most `most` quarters of an hour of edges of `group` (empty: all groups). It takes
// those that ended a minute ago, and those with late values. Returns their number.
int decimate_history(pqxx::connection& connection, const std::string& group, int most);

struct DueRequest {
  std::string group;
  std::string edge;
  std::string device;
  std::string metric;
  std::string value;
};
// Sends the due requests of the group's devices, at most one per device. Repeats them until an
// answer arrives. `send` returns false if it can't send now.
void ask_due_requests(pqxx::connection& connection, const std::string& group,
                      const std::function<bool(const DueRequest&)>& send);

}  // namespace loopwarden::fleet
