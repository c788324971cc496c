// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/writer.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "services/database/array_text.hpp"
#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::fleet {
namespace {

constexpr std::int64_t kBucketMs = 15LL * 60LL * 1000LL;

constexpr const char* kInsertEdges = R"(
INSERT INTO edge(group_name, name) SELECT * FROM unnest($1::text[], $2::text[])
  ON CONFLICT (group_name, name) DO UPDATE SET name = excluded.name
    RETURNING group_name, name, id)";

constexpr const char* kInsertDevices = R"(
INSERT INTO device(edge_id, name, tag) SELECT * FROM unnest($1::integer[], $2::text[], $3::text[])
  ON CONFLICT (edge_id, name) DO UPDATE SET tag = excluded.tag RETURNING edge_id, name, id)";

constexpr const char* kInsertMetrics = R"(
INSERT INTO metric AS m (device_id, name, type, unit, low, high, alias)
  SELECT DISTINCT ON (device_id, name) device_id, name, type, nullif(unit, ''), low, high, alias
    FROM unnest($1::integer[], $2::text[], $3::text[], $4::text[], $5::float8[], $6::float8[],
      $7::bigint[])
      WITH ORDINALITY AS new(device_id, name, type, unit, low, high, alias, n)
    ORDER BY device_id, name, n DESC
  ON CONFLICT (device_id, name) DO UPDATE
    SET type = excluded.type, unit = excluded.unit, low = excluded.low, high = excluded.high,
      alias = excluded.alias
    WHERE (m.type, m.unit, m.low, m.high, m.alias) IS DISTINCT FROM
          (excluded.type, excluded.unit, excluded.low, excluded.high, excluded.alias))";

// Removes the aliases of metrics that the newest birth does not contain.
constexpr const char* kForgetAliases = R"(
UPDATE metric m SET alias = NULL WHERE device_id = ANY($1::integer[]) AND alias IS NOT NULL
  AND NOT EXISTS
  (SELECT FROM unnest($2::integer[], $3::text[]) AS born(device_id, name)
     WHERE born.device_id = m.device_id AND born.name = m.name))";

// Inserts values. A value from a birth is stored only if it differs from the newest value. A value
// that follows another live value in its batch needs no comparison with the table. The newest value
// is the last live one; without a live one it is the one with the latest time. A birth contains all
// values, so a value older than the newest birth is never the newest.
constexpr const char* kInsertValues = R"(
WITH sent AS MATERIALIZED (
  SELECT metric_id, to_timestamp(seconds) AS time, number, text, birth, historical, transient, n
    FROM unnest($1::integer[], $2::float8[], $3::float8[], $4::text[], $5::boolean[], $6::boolean[],
      $7::boolean[])
      WITH ORDINALITY AS v(metric_id, seconds, number, text, birth, historical, transient, n)),
changed AS MATERIALIZED (
  SELECT s.* FROM sent s LEFT JOIN latest l ON s.birth AND l.metric_id = s.metric_id
    WHERE l.metric_id IS NULL OR (l.number, l.text) IS DISTINCT FROM (s.number, s.text)),
stored AS (
  INSERT INTO value(metric_id, time, number, text)
    SELECT DISTINCT ON (metric_id, time) metric_id, time, number, text FROM changed
      WHERE NOT transient
      ORDER BY metric_id, time, n DESC
    ON CONFLICT DO NOTHING RETURNING 1),
newest AS (
  INSERT INTO latest AS l (metric_id, time, number, text, historical)
    SELECT DISTINCT ON (metric_id) metric_id, time, number, text, historical FROM changed
      ORDER BY metric_id, historical, CASE WHEN NOT historical THEN n END DESC, time DESC
    ON CONFLICT (metric_id) DO UPDATE
      SET time = excluded.time, number = excluded.number, text = excluded.text,
        historical = excluded.historical
      WHERE NOT excluded.historical OR (l.time < excluded.time AND excluded.time > coalesce(
        (SELECT d.born FROM metric m JOIN device d ON d.id = m.device_id
           WHERE m.id = excluded.metric_id), '-infinity')))
SELECT (SELECT count(*) FROM stored), (SELECT count(*) FROM changed WHERE NOT transient))";

// Inserts changes of alarm states. Each state is compared with the previous one, in the table or in
// the batch. Alarms start as normal. The newest state is compared again, even if it was no change
// when it arrived: an older message that arrives later may differ from it.
constexpr const char* kInsertAlarms = R"(
WITH sent AS MATERIALIZED (
  SELECT DISTINCT ON (device_id, name, seconds) device_id, name, to_timestamp(seconds) AS time,
    state, severity
    FROM unnest($1::integer[], $2::text[], $3::float8[], $4::text[], $5::float8[])
      WITH ORDINALITY AS s(device_id, name, seconds, state, severity, n)
    ORDER BY device_id, name, seconds, n DESC),
seen AS (
  INSERT INTO alarm_seen AS k (device_id, name, time, state, severity)
    SELECT DISTINCT ON (device_id, name) device_id, name, time, state, severity
      FROM sent ORDER BY device_id, name, time DESC
    ON CONFLICT (device_id, name) DO UPDATE
      SET time = excluded.time, state = excluded.state, severity = excluded.severity
      WHERE k.time <= excluded.time),
stated AS (
  SELECT * FROM sent
  UNION ALL
  SELECT k.device_id, k.name, k.time, k.state, k.severity
    FROM alarm_seen k
      JOIN (SELECT device_id, name, min(time) AS first FROM sent GROUP BY device_id, name) s
      ON k.device_id = s.device_id AND k.name = s.name AND k.time > s.first
    WHERE NOT EXISTS (SELECT FROM sent o
      WHERE o.device_id = k.device_id AND o.name = k.name AND o.time = k.time)),
ordered AS (
  SELECT *, lag(state) OVER each AS before, lag(time) OVER each AS before_time
    FROM stated WINDOW each AS (PARTITION BY device_id, name ORDER BY time)),
changes AS (
  INSERT INTO alarm(device_id, name, time, state, severity)
    SELECT s.device_id, s.name, s.time, s.state, s.severity
      FROM ordered s LEFT JOIN LATERAL (
        SELECT a.state, a.time FROM alarm a
          WHERE a.device_id = s.device_id AND a.name = s.name AND a.time <= s.time
          ORDER BY a.time DESC LIMIT 1) stored ON true
      WHERE s.state <> CASE WHEN stored.time >= s.before_time OR s.before_time IS NULL
                            THEN coalesce(stored.state, 'normal') ELSE s.before END
    ON CONFLICT DO NOTHING RETURNING device_id, name, state, time)
INSERT INTO request(device_id, metric, value, due)
  SELECT DISTINCT device_id, 'request/evidence', name, now() + $6::integer * interval '1 second'
    FROM changes c WHERE $7::boolean AND state = 'unacknowledged' AND name <> ALL($8::text[])
      AND NOT EXISTS (SELECT FROM request r
        WHERE r.device_id = c.device_id AND r.metric = 'request/evidence' AND r.value = c.name
          AND r.due > c.time))";

// Returns the alarms without evidence on their box, as an array of text.
std::string without_evidence() {
  ArrayText names;
  for (const alarm::AlarmKind kind : alarm::kProcessAlarms) {
    names.add(std::string_view(to_text(kind)));
  }
  return names.text();
}

constexpr const char* kInsertExplanation = R"(
INSERT INTO explanation(device_id, time, parts)
  SELECT $1, to_timestamp($2::float8), coalesce(before.parts, '{}') || $3::jsonb
    FROM (VALUES(1)) one LEFT JOIN LATERAL (
      SELECT parts FROM explanation WHERE device_id = $1 AND time <= to_timestamp($2::float8)
        ORDER BY time DESC LIMIT 1) before ON true
    WHERE NOT coalesce(before.parts, '{}') @> $3::jsonb
  ON CONFLICT (device_id, time) DO UPDATE SET parts = explanation.parts || excluded.parts)";

constexpr const char* kInsertEvidence = R"(
INSERT INTO evidence(device_id, name, sha256, parts, folder) VALUES($1, $2, $3, $4, nullif($5, ''))
  ON CONFLICT (device_id, name, sha256) DO UPDATE SET parts = excluded.parts,
    folder = excluded.folder RETURNING id)";

constexpr const char* kInsertPart = R"(
INSERT INTO evidence_part(evidence_id, part, bytes) SELECT $1, $2, decode($3, 'hex')
  WHERE (SELECT coalesce(sum(octet_length(bytes)), 0) FROM evidence_part
    WHERE evidence_id = $1) < $4::bigint
  ON CONFLICT DO NOTHING)";

constexpr const char* kCompleteEvidence = R"(
UPDATE evidence e SET complete = CASE WHEN p.sha256 = e.sha256 THEN now() END,
  damaged = p.sha256 <> e.sha256
  FROM (SELECT count(*) AS count, encode(sha256(string_agg(bytes, ''::bytea ORDER BY part)),
    'hex') AS sha256
          FROM evidence_part WHERE evidence_id = $1) p
  WHERE e.id = $1 AND p.count = e.parts AND e.complete IS NULL)";

// Answers a request when all files of the folder are stored. If the edge node does not give their
// number, the first file answers it.
constexpr const char* kAnswerRequest = R"(
UPDATE request SET done = now(), answer = 'here'
  WHERE device_id = $1 AND metric = 'request/evidence' AND $2 IN ('', value) AND done IS NULL
    AND EXISTS (SELECT FROM evidence WHERE id = $3 AND (complete IS NOT NULL OR damaged))
    AND $4::integer <= (SELECT count(*) FROM evidence
      WHERE device_id = $1 AND folder = $5 AND (complete IS NOT NULL OR damaged)))";

constexpr const char* kRefuseRequest = R"(
UPDATE request SET done = now(), answer = $3
  WHERE device_id = $1 AND metric = 'request/evidence' AND value = $2 AND done IS NULL)";

constexpr const char* kUpdateEdge = R"(
UPDATE edge SET since = CASE WHEN online = $2 THEN since ELSE to_timestamp($3) END, online = $2,
    born = CASE WHEN $2 THEN to_timestamp($4) ELSE born END, births = births + $2::integer,
    clock_offset_s = CASE WHEN $2 THEN $4 - $3 ELSE clock_offset_s END
  WHERE id = $1)";

constexpr const char* kInsertEdgeEvent = R"(
INSERT INTO edge_event(edge_id, received, online)
  SELECT $1, to_timestamp($3), $2 WHERE $2 IS DISTINCT FROM
    (SELECT online FROM edge_event WHERE edge_id = $1 ORDER BY received DESC LIMIT 1)
  ON CONFLICT DO NOTHING)";

constexpr const char* kUpdateDevices = R"(
UPDATE device d SET online = e.online,
  born = CASE WHEN e.online THEN to_timestamp(e.seconds) ELSE born END
  FROM unnest($1::integer[], $2::boolean[], $3::float8[]) AS e(id, online, seconds)
    WHERE d.id = e.id)";

constexpr const char* kUpdatePositions = R"(
INSERT INTO ingest_position(edge_id, bd_seq, seq, time, received)
  SELECT id, bd_seq, seq, to_timestamp(seconds), to_timestamp(received)
    FROM unnest($1::integer[], $2::smallint[], $3::smallint[], $4::float8[], $5::float8[])
      AS p(id, bd_seq, seq, seconds, received)
  ON CONFLICT (edge_id) DO UPDATE SET bd_seq = excluded.bd_seq, seq = excluded.seq,
    time = excluded.time,
    received = excluded.received)";

constexpr const char* kInsertWaiting = R"(
INSERT INTO history_waiting(edge_id, bucket)
  SELECT id, to_timestamp(seconds) FROM unnest($1::integer[], $2::float8[]) AS w(id, seconds)
    ON CONFLICT DO NOTHING)";

double in_seconds(std::int64_t ms) { return static_cast<double>(ms) / 1e3; }

std::string hex_of(const std::string& bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

}  // namespace

class Writer::Transaction {
 public:
  Transaction(pqxx::connection& connection, const WriterSettings& settings, Batch& batch)
      : work_(connection), settings_(settings), batch_(batch) {}

  Written run() {
    number_edges();
    number_devices();
    number_metrics();
    write_events();
    write_values();
    write_alarms();
    write_explanations();
    write_files();
    write_conflicts();
    write_positions();
    work_.commit();
    return written_;
  }

 private:
  void number_edges() {
    ArrayText groups;
    ArrayText names;
    for (const auto& [name, state] : batch_.edges) {
      // Skips edge nodes without a birth: any client could invent them.
      if (state.id != 0 || !state.tracker.bd_seq()) continue;
      groups.add(name.group);
      names.add(name.edge);
    }
    if (groups.empty()) return;
    for (const pqxx::row row : work_.exec_params(kInsertEdges, groups.text(), names.text())) {
      const EdgeName name{row[0].as<std::string>(), row[1].as<std::string>()};
      batch_.edges.at(name).id = row[2].as<int>();
    }
  }

  int edge_id(const EdgeName& name) const { return batch_.edges.at(name).id; }

  void number_devices() {
    std::map<std::pair<int, std::string>, std::string> tags;
    for (const auto& [name, book] : batch_.books) {
      book->edge_id = edge_id(name);
      tags[{book->edge_id, book->device}] = book->tag;
    }
    if (tags.empty()) return;
    ArrayText edges;
    ArrayText names;
    ArrayText texts;
    for (const auto& [device, tag] : tags) {
      edges.add(device.first);
      names.add(device.second);
      texts.add(tag);
    }
    std::map<std::pair<int, std::string>, int> ids;
    for (const pqxx::row row :
         work_.exec_params(kInsertDevices, edges.text(), names.text(), texts.text())) {
      ids[{row[0].as<int>(), row[1].as<std::string>()}] = row[2].as<int>();
    }
    for (const auto& [name, book] : batch_.books) {
      book->device_id = ids.at({book->edge_id, book->device});
    }
  }

  void number_metrics() {
    if (batch_.books.empty()) return;
    ArrayText devices;
    ArrayText names;
    ArrayText types;
    ArrayText units;
    ArrayText lows;
    ArrayText highs;
    ArrayText aliases;
    std::map<int, std::vector<DeviceBook*>> books;
    ArrayText ids;
    for (const auto& [name, book] : batch_.books) {
      if (books[book->device_id].empty()) ids.add(book->device_id);
      books[book->device_id].push_back(book.get());
      for (const MetricInfo& metric : book->metrics) {
        devices.add(book->device_id);
        names.add(metric.name);
        types.add(std::string_view(sparkplug::to_text(metric.type)));
        units.add(metric.unit);
        lows.add(metric.low);
        highs.add(metric.high);
        aliases.add(metric.alias ? std::optional(static_cast<std::int64_t>(*metric.alias))
                                 : std::nullopt);
      }
    }
    if (!devices.empty()) {
      work_.exec_params(kInsertMetrics, devices.text(), names.text(), types.text(), units.text(),
                        lows.text(), highs.text(), aliases.text());
      work_.exec_params(kForgetAliases, ids.text(), devices.text(), names.text());
    }
    for (const pqxx::row row : work_.exec_params(
             "SELECT device_id, name, id FROM metric WHERE device_id = ANY($1::integer[])",
             ids.text())) {
      const std::string name = row[1].as<std::string>();
      for (DeviceBook* book : books[row[0].as<int>()]) {
        const auto found = book->by_name.find(name);
        if (found != book->by_name.end()) book->metrics[found->second].id = row[2].as<int>();
      }
    }
  }

  void write_events() {
    std::map<int, const LifeEvent*> devices;  // the newest event of each
    for (const LifeEvent& event : batch_.events) {
      if (!event.of_node) {
        devices[event.book->device_id] = &event;
        continue;
      }
      const int edge = edge_id(event.edge);
      work_.exec_params(kUpdateEdge, edge, event.online, in_seconds(event.received_ms),
                        in_seconds(event.born_ms));
      work_.exec_params(kInsertEdgeEvent, edge, event.online, in_seconds(event.received_ms));
      // Each device must send its own birth after this.
      work_.exec_params("UPDATE device SET online = false WHERE edge_id = $1 AND online", edge);
      std::erase_if(devices, [&](const auto& one) { return one.second->book->edge_id == edge; });
    }
    write_device_events(devices);
  }

  void write_device_events(const std::map<int, const LifeEvent*>& devices) {
    ArrayText ids;
    ArrayText online;
    ArrayText born;
    for (const auto& [id, event] : devices) {
      ids.add(id);
      online.add(event->online);
      born.add_time(event->born_ms);
    }
    if (!ids.empty()) work_.exec_params(kUpdateDevices, ids.text(), online.text(), born.text());
  }

  void write_values() {
    ArrayText metrics;
    ArrayText times;
    ArrayText numbers;
    ArrayText texts;
    ArrayText births;
    ArrayText historical;
    ArrayText transient;
    std::unordered_map<int, const ValueRow*> live;  // by metric: newest live value of this batch
    for (const ValueRow& row : batch_.rows.values) {
      const int metric = row.book->metrics[row.metric].id;
      bool of_birth = row.of_birth;
      if (!row.historical) {
        const ValueRow*& before = live[metric];
        if (of_birth && before != nullptr) {
          if (before->number == row.number && before->text == row.text) continue;
          of_birth = false;
        }
        before = &row;
      }
      metrics.add(metric);
      times.add_time(row.time_ms);
      numbers.add(row.number);
      texts.add(row.text);
      births.add(of_birth);
      historical.add(row.historical);
      transient.add(row.transient);
      if (row.number) waiting_.emplace(row.book->edge_id, row.time_ms / kBucketMs * kBucketMs);
    }
    if (metrics.empty()) return;
    const pqxx::row row =
        work_.exec_params1(kInsertValues, metrics.text(), times.text(), numbers.text(),
                           texts.text(), births.text(), historical.text(), transient.text());
    written_.values = row[0].as<std::uint64_t>();
    written_.duplicates = row[1].as<std::uint64_t>() - written_.values;
    write_waiting();
  }

  void write_waiting() {
    ArrayText edges;
    ArrayText buckets;
    for (const auto& [edge, bucket_ms] : waiting_) {
      edges.add(edge);
      buckets.add_time(bucket_ms);
    }
    if (!edges.empty()) work_.exec_params(kInsertWaiting, edges.text(), buckets.text());
  }

  void write_alarms() {
    ArrayText devices;
    ArrayText names;
    ArrayText times;
    ArrayText states;
    ArrayText severities;
    for (const AlarmRow& row : batch_.rows.alarms) {
      devices.add(row.book->device_id);
      names.add(row.name);
      times.add_time(row.time_ms);
      states.add(row.state);
      severities.add(row.severity);
    }
    if (devices.empty()) return;
    work_.exec_params(kInsertAlarms, devices.text(), names.text(), times.text(), states.text(),
                      severities.text(), settings_.evidence_delay_s, settings_.ask_evidence,
                      without_evidence());
  }

  void write_explanations() {
    for (const ExplanationRow& row : batch_.rows.explanations) {
      work_.exec_params(kInsertExplanation, row.book->device_id, in_seconds(row.time_ms),
                        row.parts);
    }
  }

  void write_files() {
    for (const FilePartRow& row : batch_.rows.file_parts) {
      const int id = work_
                         .exec_params1(kInsertEvidence, row.book->device_id, row.name, row.sha256,
                                       row.parts, row.folder)[0]
                         .as<int>();
      work_.exec_params(kInsertPart, id, row.part, hex_of(row.bytes),
                        settings_.most_evidence_bytes);
      work_.exec_params(kCompleteEvidence, id);
      work_.exec_params(kAnswerRequest, row.book->device_id, row.request, id, row.files,
                        row.folder);
    }
    for (const RefusalRow& row : batch_.rows.refusals) {
      work_.exec_params(kRefuseRequest, row.book->device_id, row.request, row.why);
    }
  }

  void write_conflicts() {
    for (const EdgeName& name : batch_.conflicts) {
      work_.exec_params("UPDATE edge SET conflict = now() WHERE id = $1", edge_id(name));
    }
  }

  void write_positions() {
    ArrayText edges;
    ArrayText bd_seqs;
    ArrayText seqs;
    ArrayText times;
    ArrayText received;
    for (const auto& [name, state] : batch_.edges) {
      if (state.id == 0 || state.position.received_ms == 0) continue;
      edges.add(state.id);
      bd_seqs.add(static_cast<int>(state.position.bd_seq));
      seqs.add(static_cast<int>(state.position.seq));
      times.add_time(state.position.time_ms);
      received.add_time(std::max(state.position.received_ms, state.stored_received_ms));
    }
    if (edges.empty()) return;
    work_.exec_params(kUpdatePositions, edges.text(), bd_seqs.text(), seqs.text(), times.text(),
                      received.text());
  }

  pqxx::work work_;
  const WriterSettings& settings_;
  Batch& batch_;
  Written written_;
  std::set<std::pair<int, std::int64_t>> waiting_;
};

Writer::Writer(pqxx::connection& connection, WriterSettings settings)
    : connection_(connection), settings_(settings) {}

Written Writer::write(Batch& batch) { return Transaction(connection_, settings_, batch).run(); }

namespace {

sparkplug::DataType type_of(const std::string& text) {
  for (int number = 0; number <= static_cast<int>(sparkplug::DataType::date_time_array); ++number) {
    const auto type = static_cast<sparkplug::DataType>(number);
    if (text == sparkplug::to_text(type)) return type;
  }
  return sparkplug::DataType::unknown;
}

std::map<std::string, BookPointer> books_of(pqxx::work& work, int edge_id) {
  std::map<std::string, BookPointer> books;
  for (const pqxx::row row :
       work.exec_params("SELECT d.name, d.id, d.tag, m.name, m.type, m.alias, m.id FROM device d "
                        "JOIN metric m ON m.device_id = d.id "
                        "WHERE d.edge_id = $1 AND (d.online OR d.name = '')",
                        edge_id)) {
    BookPointer& book = books[row[0].as<std::string>()];
    if (!book) {
      book = std::make_shared<DeviceBook>();
      book->device = row[0].as<std::string>();
      book->edge_id = edge_id;
      book->device_id = row[1].as<int>();
      book->tag = row[2].as<std::string>();
    }
    const std::size_t place = book->metrics.size();
    MetricInfo metric{.name = row[3].as<std::string>(), .type = type_of(row[4].as<std::string>())};
    metric.id = row[6].as<int>();
    book->by_name.try_emplace(metric.name, place);
    if (!row[5].is_null()) {
      metric.alias = static_cast<std::uint64_t>(row[5].as<std::int64_t>());
      book->by_alias.try_emplace(*metric.alias, place);
    }
    book->metrics.push_back(std::move(metric));
  }
  return books;
}

}  // namespace

void restore(pqxx::connection& connection, const std::string& group, bool with_births,
             Ingest& ingest) {
  pqxx::work work(connection);
  for (const pqxx::row row : work.exec_params(
           "SELECT e.group_name, e.name, e.id, e.online, p.bd_seq, p.seq, "
           "  (extract(epoch FROM p.time) * 1000)::bigint, (extract(epoch FROM p.received) * "
           "1000)::bigint "
           "FROM edge e JOIN ingest_position p ON p.edge_id = e.id WHERE $1 IN ('', e.group_name)",
           group)) {
    const int id = row[2].as<int>();
    const Position position{.bd_seq = static_cast<std::uint8_t>(row[4].as<int>()),
                            .seq = static_cast<std::uint8_t>(row[5].as<int>()),
                            .time_ms = row[6].as<std::int64_t>(),
                            .received_ms = row[7].as<std::int64_t>()};
    const bool goes_on = with_births && row[3].as<bool>();
    ingest.know({row[0].as<std::string>(), row[1].as<std::string>()}, id, position,
                goes_on ? books_of(work, id) : std::map<std::string, BookPointer>());
  }
}

}  // namespace loopwarden::fleet
