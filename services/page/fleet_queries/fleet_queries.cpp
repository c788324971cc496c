// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/fleet_queries.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "services/database/array_text.hpp"
#include "services/page/fleet_queries/step_curve.hpp"
#include "model/alarm/alarm_figures.hpp"
#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::fleet {
namespace {

using nlohmann::json;

constexpr const char* kNow = "SELECT (extract(epoch FROM now()) * 1000)::bigint";

constexpr const char* kGroups = R"(
WITH box AS (
  SELECT group_name, count(*) AS boxes, count(*) FILTER (WHERE online) AS online FROM edge
    GROUP BY 1),
silent AS (SELECT group_name, count(*) AS silent FROM silent_box GROUP BY 1),
loops AS (
  SELECT group_name, count(*) AS loops, count(*) FILTER (WHERE online) AS loops_online FROM loop
    GROUP BY 1),
sick AS (
  SELECT group_name, count(DISTINCT device_id) FILTER (WHERE of_valve) AS sick,
         count(DISTINCT device_id) FILTER (WHERE alarm = ANY($1::text[])) AS faulty,
         count(*) FILTER (WHERE state = 'unacknowledged') AS waiting
    FROM worst_valve GROUP BY 1)
SELECT group_name AS "group", boxes, online, coalesce(silent, 0) AS silent,
  coalesce(loops, 0) AS loops,
       coalesce(loops_online, 0) AS loops_online, coalesce(sick, 0) AS sick,
         coalesce(faulty, 0) AS faulty,
       coalesce(waiting, 0) AS waiting
  FROM box LEFT JOIN silent USING (group_name) LEFT JOIN loops USING (group_name)
    LEFT JOIN sick USING (group_name)
  ORDER BY 1)";

constexpr const char* kWorst = R"(
SELECT w.group_name AS "group", w.edge, d.name AS device, w.tag, w.alarm, w.state, w.severity,
       (extract(epoch FROM w.since) * 1000)::bigint AS since_ms, w.online, w.device_id,
       (SELECT l.text FROM metric m JOIN latest l ON l.metric_id = m.id
          WHERE m.device_id = w.device_id AND m.name = 'area') AS area, count(*) OVER () AS "all"
  FROM worst_valve w JOIN device d ON d.id = w.device_id
  WHERE $1 IN ('', w.group_name) AND w.alarm <> ALL($3::text[])
  ORDER BY w.severity DESC NULLS LAST, w.group_name, w.edge, w.tag, w.alarm LIMIT $2)";

// The view has all active alarms. This query selects those that are not a valve's.
constexpr const char* kFaulty = R"(
SELECT w.group_name AS "group", w.edge, d.name AS device, w.tag, w.alarm, w.state,
       (extract(epoch FROM w.since) * 1000)::bigint AS since_ms, w.online,
       (SELECT l.text FROM metric m JOIN latest l ON l.metric_id = m.id
          WHERE m.device_id = w.device_id AND m.name = 'area') AS area, count(*) OVER () AS "all"
  FROM worst_valve w JOIN device d ON d.id = w.device_id
  WHERE $1 IN ('', w.group_name) AND w.alarm = ANY($3::text[])
  ORDER BY w.since DESC, w.group_name, w.edge, w.tag, w.alarm LIMIT $2)";

constexpr const char* kSilent = R"(
SELECT group_name AS "group", edge, online, (extract(epoch FROM since) * 1000)::bigint AS since_ms,
       (extract(epoch FROM heard) * 1000)::bigint AS heard_ms,
         extract(epoch FROM silence)::float8 AS silence_s,
       clock_offset_s, (extract(epoch FROM conflict) * 1000)::bigint AS conflict_ms,
         count(*) OVER () AS "all"
  FROM silent_box WHERE $1 IN ('', group_name) ORDER BY heard NULLS FIRST, group_name, edge
    LIMIT $2)";

// The first configuration of a new box is no change.
constexpr const char* kDifferent = R"(
WITH changed AS (
  SELECT d.edge_id, max(v.time) AS time, count(*) AS changes
    FROM device d JOIN metric m ON m.device_id = d.id AND m.name = 'config_hash'
      JOIN value v ON v.metric_id = m.id AND v.time > now() - interval '7 days'
    WHERE d.name = '' AND EXISTS (SELECT FROM value w WHERE w.metric_id = m.id AND w.time < v.time)
    GROUP BY 1)
SELECT b.group_name AS "group", b.edge, b.version, b.config_hash, b.model_hash, b.version_differs,
  b.config_differs,
       b.model_differs, (extract(epoch FROM c.time) * 1000)::bigint AS changed_ms,
         coalesce(c.changes, 0) AS changes,
       count(*) OVER () AS "all"
  FROM box_version b LEFT JOIN changed c USING (edge_id)
  WHERE $1 IN ('', b.group_name)
    AND (b.version_differs OR b.model_differs OR b.config_differs OR c.changes IS NOT NULL)
  ORDER BY b.version_differs DESC, b.model_differs DESC, b.config_differs DESC, c.time DESC,
    b.group_name, b.edge
  LIMIT $2)";

constexpr const char* kUsual = R"(
SELECT group_name AS "group", mode() WITHIN GROUP (ORDER BY version) AS version,
       mode() WITHIN GROUP (ORDER BY model_hash) AS model_hash
  FROM box_version GROUP BY 1 ORDER BY 1)";

constexpr const char* kRaised = R"(
SELECT l.group_name, floor(date_part('epoch', r.time) / $3::bigint)::bigint AS bin, count(*)
  FROM alarm_raised r JOIN loop l USING (device_id)
  WHERE r.raised AND r.time >= to_timestamp($1::bigint) AND r.time < to_timestamp($2::bigint)
  GROUP BY 1, 2)";

constexpr const char* kCame = R"(
SELECT (extract(epoch FROM r.time) * 1000)::bigint, l.edge || '/' || l.tag, r.name
  FROM alarm_raised r JOIN loop l USING (device_id)
  WHERE r.raised AND r.time >= to_timestamp($1::float8) AND $2 IN ('', l.group_name)
  ORDER BY r.time DESC LIMIT 50000)";

// Uses the register, which is 0 while the alarm is off. For other edges it uses the alarm's own
// metric, which they omit while it is off.
constexpr const char* kCurves = R"(
WITH asked AS (
  SELECT p.place, (SELECT m.id FROM metric m
                     WHERE m.device_id = p.device_id
                       AND m.name IN ('severity_' || p.alarm, 'alarm/' || p.alarm || '/severity')
                     ORDER BY m.name DESC LIMIT 1) AS metric_id
    FROM unnest($1::integer[], $2::text[]) WITH ORDINALITY AS p(device_id, alarm, place))
SELECT place, -1 AS step, before.last, before.last
  FROM asked a JOIN LATERAL (
    SELECT h.last FROM history_decimated h
      WHERE h.metric_id = a.metric_id AND h.bucket < to_timestamp($3::bigint) ORDER BY h.bucket DESC
        LIMIT 1) before ON true
UNION ALL
SELECT place, floor((date_part('epoch', h.bucket) - $3::bigint) / $4::bigint)::integer, max(h.high),
       (array_agg(h.last ORDER BY h.bucket DESC))[1]
  FROM asked a JOIN history_decimated h USING (metric_id) WHERE h.bucket >= to_timestamp($3::bigint)
  GROUP BY 1, 2
ORDER BY 1, 2)";

constexpr const char* kValve = R"(
SELECT d.id AS device_id, e.group_name AS "group", e.name AS edge, d.name AS device, d.tag,
  e.online AND d.online AS online,
       e.online AS box_online, (extract(epoch FROM e.since) * 1000)::bigint AS box_since_ms,
       (extract(epoch FROM p.received) * 1000)::bigint AS heard_ms
  FROM edge e JOIN device d ON d.edge_id = e.id LEFT JOIN ingest_position p ON p.edge_id = e.id
  WHERE e.group_name = $1 AND e.name = $2 AND d.name = $3 AND d.name <> '')";

constexpr const char* kAlarms = R"(
SELECT name AS alarm, state, active, severity,
  (extract(epoch FROM changed) * 1000)::bigint AS changed_ms
  FROM alarm_now WHERE device_id = $1 ORDER BY active DESC, severity DESC NULLS LAST, name)";

constexpr const char* kIncident = R"(
SELECT id, name, cause, confidence, active, unacknowledged,
  (extract(epoch FROM raised) * 1000)::bigint AS raised_ms
  FROM incident_now WHERE device_id = $1 AND name <> '')";

constexpr const char* kChanges = R"(
SELECT name AS alarm, state, severity, (extract(epoch FROM time) * 1000)::bigint AS time_ms
  FROM alarm WHERE device_id = $1 AND time >= to_timestamp($2::bigint) ORDER BY time DESC
    LIMIT 500)";

constexpr const char* kExplanation = R"(
SELECT (extract(epoch FROM time) * 1000)::bigint AS time_ms, parts
  FROM explanation WHERE device_id = $1 ORDER BY time DESC LIMIT 1)";

constexpr const char* kValues = R"(
SELECT m.name, l.number, l.text, m.unit, m.low, m.high,
  (extract(epoch FROM l.time) * 1000)::bigint AS time_ms
  FROM metric m JOIN latest l ON l.metric_id = m.id
  WHERE m.device_id = $1 AND (m.name LIKE 'condition/%' OR m.name LIKE 'detectable/%' OR m.name IN
    ('pv', 'sp', 'co', 'stem', 'variability', 'mean_error', 'oscillation_index',
      'oscillation_period', 'travel',
     'reversals', 'stick', 'saturated'))
  ORDER BY m.name)";

constexpr const char* kEvidence = R"(
SELECT name, (extract(epoch FROM begun) * 1000)::bigint AS begun_ms,
  complete IS NOT NULL AS complete
  FROM evidence WHERE device_id = $1 ORDER BY begun DESC LIMIT 50)";

// Returns the process alarms as an array of text.
std::string process_alarms() {
  ArrayText names;
  for (const alarm::AlarmKind kind : alarm::kProcessAlarms)
    names.add(std::string_view(to_text(kind)));
  return names.text();
}

// Types of columns, as numbered by PostgreSQL.
enum : pqxx::oid { kBool = 16, kInt8 = 20, kInt4 = 23, kFloat8 = 701, kJsonb = 3802 };

json field_json(const pqxx::field& field) {
  if (field.is_null()) return nullptr;
  switch (field.type()) {
    case kBool: return field.as<bool>();
    case kInt8:
    case kInt4: return field.as<std::int64_t>();
    case kFloat8: return field.as<double>();
    case kJsonb: return json::parse(field.c_str());
    default: return field.as<std::string>();
  }
}

json row_json(const pqxx::row& row) {
  json object = json::object();
  for (const pqxx::field field : row) object[field.name()] = field_json(field);
  return object;
}

json rows_json(const pqxx::result& rows) {
  json list = json::array();
  for (const pqxx::row row : rows) list.push_back(row_json(row));
  return list;
}

// Makes a bounded list of rows that each contain the total number.
json limited(const pqxx::result& rows) {
  json list = rows_json(rows);
  json all = list.empty() ? json(0) : list.front()["all"];
  for (json& row : list) row.erase("all");
  return {{"all", std::move(all)}, {"list", std::move(list)}};
}

json curves_of(pqxx::transaction_base& database, int device_id, const json& alarms,
               const json& changes, std::int64_t now) {
  std::vector<AlarmName> names;
  for (const json* list : {&alarms, &changes}) {
    for (const json& one : *list) names.push_back({device_id, one["alarm"]});
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  const auto curves = severity_curves(database, names, kWeeksOfValve, now);
  json severity = json::object();
  for (std::size_t i = 0; i < names.size(); ++i) severity[names[i].alarm] = numbers_json(curves[i]);
  return {{"from_ms", 1000 * kWeeksOfValve.from_s(now)},
          {"step_s", kWeeksOfValve.step_s},
          {"severity", std::move(severity)}};
}

}  // namespace

std::int64_t now_ms(pqxx::transaction_base& database) {
  return database.exec1(kNow)[0].as<std::int64_t>();
}

json groups(pqxx::transaction_base& database) {
  return rows_json(database.exec_params(kGroups, process_alarms()));
}

json worst_valves(pqxx::transaction_base& database, const std::string& group) {
  return limited(database.exec_params(kWorst, group, kMostValves, process_alarms()));
}

json faulty_loops(pqxx::transaction_base& database, const std::string& group) {
  return limited(database.exec_params(kFaulty, group, kMostValves, process_alarms()));
}

json silent_boxes(pqxx::transaction_base& database, const std::string& group) {
  return limited(database.exec_params(kSilent, group, kMostBoxes));
}

json different_boxes(pqxx::transaction_base& database, const std::string& group) {
  return limited(database.exec_params(kDifferent, group, kMostBoxes));
}

json usual_versions(pqxx::transaction_base& database) { return rows_json(database.exec(kUsual)); }

json day_figures(pqxx::transaction_base& database, const std::string& group, std::int64_t now_ms) {
  constexpr std::int64_t kDay_ms = 86'400'000;
  std::vector<alarm::AlarmCame> came;
  for (const pqxx::row row :
       database.exec_params(kCame, static_cast<double>(now_ms - kDay_ms) / 1000.0, group)) {
    came.push_back({row[0].as<std::int64_t>(), row[1].as<std::string>(), row[2].as<std::string>()});
  }
  const alarm::AlarmFigures figures = alarm::figures_of(came, now_ms - kDay_ms, now_ms);
  const auto counted = [](const std::vector<alarm::CountedAlarm>& alarms) {
    json list = json::array();
    for (const alarm::CountedAlarm& one : alarms) {
      list.push_back({{"loop", one.source},
                      {"alarm", one.alarm},
                      {"count", one.count},
                      {"percent", one.percent}});
    }
    return list;
  };
  return {{"came", figures.came},
          {"per_hour", figures.per_hour},
          {"most_in_10_min", figures.most_in_stretch},
          {"floods", figures.floods},
          {"flood_percent", figures.flood_percent},
          {"top", counted(figures.top)},
          {"chattering", counted(figures.chattering)}};
}

std::vector<RaisedRow> raised_between(pqxx::transaction_base& database, std::int64_t from_s,
                                      std::int64_t until_s) {
  std::vector<RaisedRow> rows;
  for (const pqxx::row row : database.exec_params(kRaised, from_s, until_s, kBin_s)) {
    rows.push_back(
        {row[0].as<std::string>(), row[1].as<std::int64_t>(), row[2].as<std::int64_t>()});
  }
  return rows;
}

std::vector<std::vector<double>> severity_curves(pqxx::transaction_base& database,
                                                 const std::vector<AlarmName>& alarms,
                                                 const StepSpan& span, std::int64_t now_ms) {
  ArrayText devices;
  ArrayText names;
  for (const AlarmName& alarm : alarms) {
    devices.add(alarm.device_id);
    names.add(alarm.alarm);
  }
  std::vector<std::vector<StepRow>> rows(alarms.size());
  if (!alarms.empty()) {
    for (const pqxx::row row : database.exec_params(kCurves, devices.text(), names.text(),
                                                    span.from_s(now_ms), span.step_s)) {
      rows.at(row[0].as<std::size_t>() - 1)
          .push_back({row[1].as<int>(), row[2].as<double>(), row[3].as<double>()});
    }
  }
  std::vector<std::vector<double>> curves;
  curves.reserve(rows.size());
  for (const auto& one : rows) {
    curves.push_back(step_curve(one, static_cast<std::size_t>(span.steps)));
  }
  return curves;
}

std::optional<json> valve(pqxx::transaction_base& database, const ValveName& name) {
  const pqxx::result found = database.exec_params(kValve, name.group, name.edge, name.device);
  if (found.empty()) return std::nullopt;
  json valve = row_json(found[0]);
  const int id = valve["device_id"].get<int>();
  const std::int64_t now = now_ms(database);
  valve.erase("device_id");
  valve["now_ms"] = now;
  valve["alarms"] = rows_json(database.exec_params(kAlarms, id));
  const json incidents = rows_json(database.exec_params(kIncident, id));
  valve["incident"] = incidents.empty() ? json() : incidents[0];
  valve["changes"] = rows_json(database.exec_params(kChanges, id, kWeeksOfValve.from_s(now)));
  valve["weeks"] = curves_of(database, id, valve["alarms"], valve["changes"], now);
  const json explanations = rows_json(database.exec_params(kExplanation, id));
  valve["explanation"] = explanations.empty() ? json() : explanations[0];
  valve["values"] = rows_json(database.exec_params(kValues, id));
  valve["evidence"] = rows_json(database.exec_params(kEvidence, id));
  return valve;
}

json numbers_json(const std::vector<double>& values) {
  json list = json::array();
  for (const double value : values) list.push_back(std::isfinite(value) ? json(value) : json());
  return list;
}

}  // namespace loopwarden::fleet
