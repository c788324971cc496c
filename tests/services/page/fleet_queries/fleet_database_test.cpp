// SPDX-License-Identifier: Apache-2.0
// A real PostgreSQL with the host's tables, started by the test. If it is not installed, the tests
// are left out with a notice.
#include "services/page/fleet_queries/fleet_database.hpp"

#include <catch2/catch.hpp>
#include <string>

#include <nlohmann/json.hpp>

#include "services/database/connection.hpp"
#include "services/fleet/host/maintenance.hpp"
#include "services/fleet/host/migrations.hpp"
#include "tests/support/postgres.hpp"

namespace loopwarden::tests::fleet_database_test {

using namespace fleet;
using namespace std::chrono_literals;
using nlohmann::json;

constexpr CacheLimits kNoCache{.fresh = 0ms, .retry_after = 0ms};

// North: box1 and box2 answer, box3 is away. South: box4 is connected and silent.
constexpr const char* kPlant = R"(
INSERT INTO edge(group_name, name, online, since, clock_offset_s) VALUES
  ('North', 'box1', true, now() - interval '9 days', 0), ('North', 'box2', true, now() - interval
      '9 days', 0),
  ('North', 'box3', false, now() - interval '1 hour', 90), ('South', 'box4', true, now() -
      interval '9 days', 0);
INSERT INTO ingest_position SELECT id, 0, 0, now(), now() - quiet * interval '1 minute'
  FROM edge JOIN (VALUES('box1', 0), ('box2', 0), ('box3', 60), ('box4', 10)) q(name, quiet) USING
      (name);
INSERT INTO device(edge_id, name, tag, online) SELECT id, '', '', online FROM edge;
INSERT INTO device(edge_id, name, tag, online) SELECT id, 'FIC_' || n, 'FIC/' || n, online FROM
    edge, generate_series(1, 2) n;

INSERT INTO metric(device_id, name, type) SELECT d.id, m, 'String' FROM device d,
    unnest(ARRAY['version', 'config_hash', 'model_hash']) m
  WHERE d.name = '';
INSERT INTO latest SELECT m.id, now() - interval '9 days',
    CASE m.name WHEN 'model_hash' THEN 77 WHEN 'config_hash' THEN e.id END,
    CASE m.name WHEN 'version' THEN CASE e.name WHEN 'box2' THEN '0.1.9' ELSE '0.2.0' END END, false
  FROM metric m JOIN device d ON d.id = m.device_id JOIN edge e ON e.id = d.edge_id;
-- box1 had another configuration until yesterday; box4's is its first.
INSERT INTO value SELECT m.id, now() - ago * interval '1 day', ago FROM metric m JOIN device d ON
    d.id = m.device_id
    JOIN edge e ON e.id = d.edge_id JOIN (VALUES('box1', 1), ('box1', 9), ('box4', 1)) v(name,
        ago) ON v.name = e.name
  WHERE m.name = 'config_hash';

INSERT INTO metric(device_id, name, type, unit) SELECT l.device_id, m, 'Double', '%' FROM loop l,
    unnest(ARRAY['severity_stiction',
  'alarm/stiction/severity', 'condition/valve', 'pv']) m;
-- On twice: ten days ago until nine days ago, and since two hours.
INSERT INTO alarm SELECT device_id, 'stiction', now() - ago * interval '1 hour', state, 2 FROM loop,
  (VALUES(240, 'unacknowledged'), (230, 'acknowledged'), (216, 'normal'), (2, 'unacknowledged'),
      (1, 'acknowledged')) s(ago, state)
  WHERE edge = 'box1' AND device = 'FIC_1';
INSERT INTO alarm SELECT device_id, 'stiction', now() - interval '3 hours', 'unacknowledged', 9
    FROM loop WHERE edge = 'box4' AND device = 'FIC_2';
INSERT INTO alarm SELECT device_id, 'backlash', now() - interval '3 hours', 'unacknowledged', 9
    FROM loop WHERE edge = 'box2' AND device = 'FIC_2';
INSERT INTO alarm SELECT device_id, 'backlash', now() - interval '2 hours',
    'returned_unacknowledged', 9 FROM loop WHERE edge = 'box2' AND device = 'FIC_2';
-- No valve is sick of these: the loops don't do their work.
INSERT INTO alarm SELECT device_id, name, now() - ago * interval '1 hour', 'unacknowledged', NULL
    FROM loop,
  (VALUES('output_lost', 5), ('bad_pv', 4)) p(name, ago) WHERE edge = 'box2' AND device = 'FIC_1';
INSERT INTO latest SELECT m.id, now(), CASE m.name WHEN 'pv' THEN 5.5 WHEN 'condition/valve' THEN
    31 ELSE 6.25 END, NULL, false
  FROM metric m JOIN loop l USING (device_id) WHERE l.edge = 'box1' AND l.device = 'FIC_1' AND
      m.name <> 'severity_stiction';
INSERT INTO history_decimated SELECT m.id, date_bin('1 day', now(), 'epoch') - ago * interval
    '1 day', 1, h.high, h.high, h.high, h.last
  FROM metric m JOIN loop l USING (device_id), (VALUES(100, 8, 1), (10, 3, 2), (9, 2, 0)) h(ago,
      high, last)
  WHERE l.edge = 'box1' AND l.device = 'FIC_1' AND m.name = 'severity_stiction';
INSERT INTO explanation SELECT device_id, now(),
    '{"effect": "stiction", "size": 6.0, "agrees": true}' FROM loop WHERE edge = 'box1' AND device
    = 'FIC_1';
INSERT INTO evidence(device_id, name, sha256, parts, complete) SELECT device_id, 'record.csv',
    '00', 1, now() FROM loop WHERE edge = 'box1' AND device = 'FIC_1';
)";

bool installed() {
  const bool is = !Postgres::programs().empty();
  if (!is) WARN("left out: postgresql is not installed (tools/debian-packages.txt)");
  return is;
}

void fill(const Postgres& database) {
  const auto connection = loopwarden::fleet::open_database({database.url(), {}});
  loopwarden::fleet::migrate(*connection);
  loopwarden::fleet::keep_partitions(*connection, {});
  pqxx::nontransaction(*connection).exec(kPlant);
}

json parsed(const std::shared_ptr<const std::string>& answer) {
  return answer ? json::parse(*answer) : json();
}

// Returns the values at `key` of a list of objects.
json column(const json& list, const char* key) {
  json values = json::array();
  for (const json& one : list) values.push_back(one.at(key));
  return values;
}

void check_groups(const json& groups) {
  REQUIRE(groups.size() == 2);
  CHECK(groups[0] == json{{"group", "North"},
                          {"boxes", 3},
                          {"online", 2},
                          {"silent", 1},
                          {"loops", 6},
                          {"loops_online", 4},
                          {"sick", 1},
                          {"faulty", 1},
                          {"waiting", 2}});
  CHECK(groups[1] == json{{"group", "South"},
                          {"boxes", 1},
                          {"online", 1},
                          {"silent", 1},
                          {"loops", 2},
                          {"loops_online", 2},
                          {"sick", 1},
                          {"faulty", 0},
                          {"waiting", 1}});
}

void check_valves(const json& overview) {
  const json& valves = overview["valves"];
  CHECK(valves["all"] == 2);
  CHECK(column(valves["list"], "edge") == json{"box4", "box1"});
  const json& one = valves["list"][1];
  CHECK(one["device"] == "FIC_1");
  CHECK(one["tag"] == "FIC/1");
  CHECK(one["alarm"] == "stiction");
  CHECK(one["state"] == "acknowledged");
  CHECK(one["severity"] == 6.25);  // the present value, not the value at the change
  CHECK_FALSE(one.contains("device_id"));
  // Since it was raised, not since it was acknowledged.
  const double ago_h = (overview["now_ms"].get<double>() - one["since_ms"].get<double>()) / 3.6e6;
  CHECK(ago_h == Approx(2.0).margin(0.1));
}

// 8 % before the eight weeks begin, 1 % since; 3 % ten days ago, 0 from nine days ago on.
void check_curve(const json& weeks) {
  REQUIRE(weeks.size() == 56);
  CHECK(weeks[0] == 1.0);
  CHECK(weeks[44] == 1.0);
  CHECK(weeks[45] == 3.0);
  CHECK(weeks[46] == 2.0);
  CHECK(weeks[47] == 0.0);
  CHECK(weeks[54] == 0.0);
  CHECK(weeks[55] == 6.25);  // the present value; the history is older
}

TEST_CASE("the plant is read from the host's tables") {
  if (!installed()) return;
  const Postgres database;
  fill(database);
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  const json all = parsed(fleet.overview(""));
  check_groups(all["groups"]);
  check_valves(all);
  check_curve(all["valves"]["list"][1]["weeks"]);
  const json& faults = all["faults"];
  CHECK(faults["all"] == 2);
  CHECK(column(faults["list"], "alarm") == json{"bad_pv", "output_lost"});
  CHECK(column(faults["list"], "device") == json{"FIC_1", "FIC_1"});
  CHECK(all["now_ms"].get<double>() - faults["list"][0]["since_ms"].get<double>() ==
        Approx(4 * 3.6e6).margin(6e4));
  // A valve without a history has only its present state.
  std::vector<json> now(56);
  now.back() = 9.0;
  CHECK(all["valves"]["list"][0]["weeks"] == json(now));
  CHECK(all["silent"]["all"] == 2);
  CHECK(column(all["silent"]["list"], "edge") == json{"box3", "box4"});
  CHECK(column(all["silent"]["list"], "online") == json{false, true});
  CHECK(all["silent"]["list"][0]["clock_offset_s"] == 90.0);
  CHECK(all["silent"]["list"][0]["silence_s"].get<double>() == Approx(3600).margin(60));
  const json& versions = all["versions"];
  CHECK(versions["all"] == 2);
  CHECK(column(versions["list"], "edge") == json{"box2", "box1"});
  CHECK(column(versions["list"], "version_differs") == json{true, false});
  // each has a separate value
  CHECK(column(versions["list"], "config_differs") == json{false, false});
  CHECK(column(versions["list"], "changes") == json{0, 1});
  CHECK(column(versions["usual"], "version") == json{"0.2.0", "0.2.0"});
  const json& rates = all["alarm_rate"]["list"];
  CHECK(column(rates, "group") == json{"", "North", "South"});
  CHECK(rates[0]["day"]["raised"] == 5);
  CHECK(rates[1]["week"]["raised"] == 4);  // the third stiction alarm is ten days old
  CHECK(rates[0]["bins"].size() == 144);
  const json& figures = all["alarm_figures"];
  CHECK(figures["came"] == 5);
  CHECK(figures["floods"] == 0);
  CHECK(figures["top"].size() == 5);
  CHECK(figures["top"][0]["percent"] == 20.0);
  CHECK(figures["chattering"].empty());

  const json south = parsed(fleet.overview("South"));
  CHECK(south["valves"]["all"] == 1);
  CHECK(south["faults"]["all"] == 0);
  CHECK(column(south["silent"]["list"], "edge") == json{"box4"});
  CHECK(south["versions"]["all"] == 0);
  CHECK(south["alarm_figures"]["came"] == 1);
  CHECK(south["alarm_figures"]["top"][0]["loop"] == "box4/FIC/2");
  CHECK(south["groups"].size() == 2);
  CHECK(parsed(fleet.overview("'; DROP TABLE edge; --"))["valves"]["all"] == 0);
  CHECK(database.ask("SELECT count(*) FROM edge") == "4");
}

TEST_CASE("an alarm outside the valve gives no loop with a valve alarm") {
  if (!installed()) return;
  const Postgres database;
  fill(database);
  pqxx::connection connection(database.url());
  pqxx::nontransaction(connection)
      .exec(
          "INSERT INTO alarm SELECT device_id, 'model_gap', now(), 'unacknowledged', NULL FROM "
          "loop "
          "WHERE edge = 'box4'");
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  const json all = parsed(fleet.overview(""));
  CHECK(all["groups"][1]["sick"] == 1);
  CHECK(all["groups"][1]["waiting"] == 3);
  CHECK(all["valves"]["all"] == 4);
}

// Adds the metrics of an incident of a loop of box4.
void tell_incident(pqxx::nontransaction& work, const std::string& name, const std::string& cause,
                   bool active) {
  const auto tell = [&](const char* part, const std::string& number, const std::string& text) {
    work.exec_params(
        "WITH m AS (INSERT INTO metric(device_id, name, type) SELECT device_id, $1, 'String' FROM "
        "loop WHERE edge = 'box4' AND device = 'FIC_2' ON CONFLICT (device_id, name) DO UPDATE SET "
        "type = 'String' RETURNING id) INSERT INTO latest SELECT id, now(), "
        "nullif($2, '')::float8, nullif($3, ''), false FROM m ON CONFLICT (metric_id) DO UPDATE "
        "SET "
        "number = excluded.number, text = excluded.text",
        std::string("incident/") + part, number, text);
  };
  tell("id", "", "FIC/2-20261126T090000Z");
  tell("name", "", name);
  tell("cause", "", cause);
  tell("confidence", "0.94", "");
  tell("active", active ? "1" : "0", "");
  tell("unacknowledged", "1", "");
  tell("raised", "1795683600000", "");
}

TEST_CASE("an incident is one line, and one outside of the valve gives no valve fault") {
  if (!installed()) return;
  const Postgres database;
  fill(database);
  pqxx::connection connection(database.url());
  pqxx::nontransaction work(connection);
  work.exec(
      "INSERT INTO alarm SELECT device_id, 'model_gap', now(), 'acknowledged', NULL FROM loop "
      "WHERE edge = 'box4' AND device = 'FIC_2'");
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  tell_incident(work, "stiction", "valve", true);
  json south = parsed(fleet.overview("South"));
  CHECK(south["groups"][1]["sick"] == 1);
  CHECK(south["groups"][1]["waiting"] == 1);
  REQUIRE(south["valves"]["all"] == 1);
  CHECK(south["valves"]["list"][0]["alarm"] == "stiction");
  CHECK(south["valves"]["list"][0]["severity"] == 9.0);
  CHECK(south["valves"]["list"][0]["since_ms"] == 1795683600000);

  tell_incident(work, "gain_change", "process", true);
  south = parsed(fleet.overview("South"));
  CHECK(south["groups"][1]["sick"] == 0);
  REQUIRE(south["valves"]["all"] == 1);
  CHECK(south["valves"]["list"][0]["alarm"] == "gain_change");
  CHECK(south["valves"]["list"][0]["severity"].is_null());
  const json valve = parsed(fleet.valve({"South", "box4", "FIC_2"}));
  CHECK(valve["incident"]["name"] == "gain_change");
  CHECK(valve["incident"]["confidence"] == 0.94);

  // After an incident has ended, each active alarm is listed separately again.
  tell_incident(work, "gain_change", "process", false);
  south = parsed(fleet.overview("South"));
  CHECK(south["groups"][1]["sick"] == 1);
  CHECK(south["valves"]["all"] == 2);
}

TEST_CASE("a valve has its history and alarms") {
  if (!installed()) return;
  const Postgres database;
  fill(database);
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  const json valve = parsed(fleet.valve({"North", "box1", "FIC_1"}));
  CHECK(valve["tag"] == "FIC/1");
  CHECK(valve["online"] == true);
  CHECK(column(valve["alarms"], "state") == json{"acknowledged"});
  CHECK(valve["incident"].is_null());
  CHECK(column(valve["changes"], "state") ==
        json{"acknowledged", "unacknowledged", "normal", "acknowledged", "unacknowledged"});
  const json& curve = valve["weeks"]["severity"]["stiction"];
  REQUIRE(curve.size() == 364);
  CHECK(curve.front() == 1.0);  // the value at its end a hundred days ago
  CHECK(curve.back() == 0.0);
  CHECK(valve["explanation"]["parts"]["effect"] == "stiction");
  CHECK(column(valve["values"], "name") == json{"condition/valve", "pv"});
  CHECK(column(valve["values"], "number") == json{31.0, 5.5});
  CHECK(column(valve["evidence"], "complete") == json{true});
  CHECK(fleet.valve({"North", "box1", "FIC_3"}) == nullptr);
  CHECK(fleet.valve({"South", "box1", "FIC_1"}) == nullptr);
  CHECK(fleet.valve({"North", "box1", ""}) == nullptr);  // the box itself
}

TEST_CASE("a database that stops is reported, and found again") {
  if (!installed()) return;
  Postgres database;
  fill(database);
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  CHECK(fleet.last_overview("") == nullptr);
  const auto before = fleet.overview("");
  database.stop();
  CHECK_THROWS_AS(fleet.overview(""), FleetDown);
  CHECK_THROWS_AS(fleet.valve({"North", "box1", "FIC_1"}), FleetDown);
  CHECK(fleet.last_overview("") == before);
  database.start();
  CHECK(parsed(fleet.overview(""))["groups"].size() == 2);
}

TEST_CASE("a database without the host's tables is reported") {
  if (!installed()) return;
  const Postgres database;
  FleetDatabase fleet({database.url(), {}}, kNoCache);
  CHECK_THROWS_WITH(fleet.overview(""), Catch::Contains("does not exist"));
}

}  // namespace loopwarden::tests::fleet_database_test
