// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/maintenance.hpp"

#include <spdlog/spdlog.h>

namespace loopwarden::fleet {
namespace {

constexpr const char* kDropOld = R"(
WITH event AS (DELETE FROM edge_event WHERE received < now() - $1 * interval '1 day'),
     change AS (DELETE FROM alarm WHERE time < now() - $1 * interval '1 day'),
     explained AS (DELETE FROM explanation WHERE time < now() - $1 * interval '1 day'),
     asked AS (DELETE FROM request WHERE due < now() - interval '31 days')
DELETE FROM evidence WHERE begun < now() - $2 * interval '1 day')";

// Takes the quarters of an hour that are due. Limit: if values arrive after the partition of their
// day was dropped, the history of that quarter is made from those late values only.
constexpr const char* kTakeWaiting = R"(
DELETE FROM history_waiting w USING (
    SELECT edge_id, bucket FROM history_waiting h JOIN edge e ON e.id = h.edge_id
      WHERE $1 IN ('', e.group_name) AND bucket < now() - interval '16 minutes'
      ORDER BY bucket LIMIT $2 FOR UPDATE OF h SKIP LOCKED) taken
  WHERE w.edge_id = taken.edge_id AND w.bucket = taken.bucket RETURNING w.edge_id, w.bucket)";

// A request to an offline box waits until the box is online. The pause doubles after each attempt.
constexpr const char* kDue = R"(
SELECT r.id, r.tries, e.group_name, e.name, d.name, r.metric, r.value
  FROM request r JOIN device d ON d.id = r.device_id JOIN edge e ON e.id = d.edge_id
  WHERE e.online AND $1 IN ('', e.group_name) AND r.id IN (
    SELECT DISTINCT ON (device_id) id FROM request
      WHERE done IS NULL AND due < now()
        AND (sent IS NULL OR sent < now() - interval '10 minutes' * power(2, tries - 1))
      ORDER BY device_id, due)
  FOR UPDATE OF r SKIP LOCKED)";
constexpr int kMostTries = 6;  // the last attempt is five hours after the first

constexpr const char* kSent = "UPDATE request SET sent = now(), tries = tries + 1 WHERE id = $1";
constexpr const char* kGivenUp =
    "UPDATE request SET done = now(), answer = 'never answered' WHERE id = $1";

}  // namespace

int keep_partitions(pqxx::connection& connection, const Retention& retention) {
  pqxx::work work(connection);
  if (!work.exec1("SELECT pg_try_advisory_xact_lock(hashtext('loopwarden-fleet partitions'))")[0]
           .as<bool>()) {
    return 0;
  }
  // A long-running reader must not block the writing of values, which queues after this lock.
  work.exec("SET LOCAL lock_timeout = '2s'");
  work.exec_params("SELECT make_partitions($1)", kPartitionDaysAhead);
  const int values =
      work.exec_params1(
              "SELECT drop_partitions('value', 'time', 'day', now() - $1 * interval '1 day')",
              retention.values_days)[0]
          .as<int>();
  const int history = work.exec_params1(
                              "SELECT drop_partitions('history_decimated', 'bucket', 'month', "
                              "now() - $1 * interval '1 day')",
                              retention.history_days)[0]
                          .as<int>();
  work.exec_params(kDropOld, retention.history_days, retention.evidence_days);
  work.commit();
  return values + history;
}

int decimate_history(pqxx::connection& connection, const std::string& group, int most) {
  pqxx::work work(connection);
  const pqxx::result taken = work.exec_params(kTakeWaiting, group, most);
  for (const pqxx::row row : taken) {
    work.exec_params("SELECT decimate($1, $2)", row[0].as<int>(), row[1].as<std::string>());
  }
  work.commit();
  return static_cast<int>(taken.size());
}

void ask_due_requests(pqxx::connection& connection, const std::string& group,
                      const std::function<bool(const DueRequest&)>& send) {
  pqxx::work work(connection);
  for (const pqxx::row row : work.exec_params(kDue, group)) {
    const int id = row[0].as<int>();
    const DueRequest request{row[2].as<std::string>(), row[3].as<std::string>(),
                             row[4].as<std::string>(), row[5].as<std::string>(),
                             row[6].as<std::string>()};
    if (row[1].as<int>() >= kMostTries) {
      work.exec_params(kGivenUp, id);
      spdlog::warn("{}/{}/{}: {} {} was requested {} times without an answer", request.group,
                   request.edge, request.device, request.metric, request.value, kMostTries);
    } else if (send(request)) {
      work.exec_params(kSent, id);
    }
  }
  work.commit();
}

}  // namespace loopwarden::fleet
