// SPDX-License-Identifier: Apache-2.0
// What keeps the database in shape beside the flow of values: partitions made ahead and dropped when they are old, the
// decimated history, requests that are due.
#pragma once

#include <functional>
#include <string>

#include <pqxx/pqxx>

namespace loopwarden::fleet {

struct Retention {
  int values_days = 31;  // every value
  int history_days =
      3 * 366;  // a quarter of an hour's mean, low, high, last; alarms and events too
  int evidence_days = 366;
};

inline constexpr int kPartitionDaysAhead = 3;

// Partitions, and what is old. Of several processes one does it, the others go on at once. Returns the partitions
// dropped.
int keep_partitions(pqxx::connection& connection, const Retention& retention);

// Takes over at most `most` quarters of an hour of edges of `group` (empty: all groups) that ended a minute ago, or
// whose values came late. Returns how many.
int decimate_history(pqxx::connection& connection, const std::string& group, int most);

struct DueRequest {
  std::string group;
  std::string edge;
  std::string device;
  std::string metric;
  std::string value;
};
// Sends the requests of the group's devices that are due, at most one a device, and again while no answer has come.
// `send` returns false if it can't go out now.
void ask_due_requests(pqxx::connection& connection, const std::string& group,
                      const std::function<bool(const DueRequest&)>& send);

}  // namespace loopwarden::fleet
