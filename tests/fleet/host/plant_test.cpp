// SPDX-License-Identifier: Apache-2.0
// loopwarden-fleet with a real Mosquitto and a real PostgreSQL, both of the test's own; the edges are simulated. Left
// out, with a word, where one of them is not installed.
#include <catch2/catch.hpp>

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <atomic>
#include <map>
#include <memory>
#include <utility>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <pqxx/pqxx>

#include "fleet/database/connection.hpp"
#include "fleet/host/lease.hpp"
#include "fleet/host/maintenance.hpp"
#include "fleet/host/migrations.hpp"
#include "fleet/mqtt/client.hpp"
#include "fleet/sparkplug/host_state.hpp"
#include "tests/fleet/host/messages.hpp"
#include "tests/support/mqtt_broker.hpp"
#include "tests/support/postgres.hpp"

namespace loopwarden::plant_test {
namespace {

using namespace std::chrono_literals;
using fleet::Arrival;
using sparkplug::DataType;
using test::eventually;
using tests::EdgeMessages;
using tests::metric;

bool installed() {
  const bool all =
      std::filesystem::exists("/usr/sbin/mosquitto") && !tests::Postgres::programs().empty();
  if (!all) WARN("left out: mosquitto or postgresql is not installed (tools/debian-packages.txt)");
  return all;
}

class HostProcess {
 public:
  HostProcess(const tests::Postgres& database, int broker_port, std::string name,
              std::string groups = "A", std::string more = "")
      : name_(std::move(name)) {
    tests::write_file(folder_ / "fleet.yaml", "state_directory: " + (folder_ / "state").string() +
                                                  "\nmetrics: {port: 0}\n" + more);
    words_ = {LOOPWARDEN_BIN_DIR "/loopwarden-fleet",
              "--broker",
              "mqtt://127.0.0.1:" + std::to_string(broker_port),
              "--database",
              database.url(),
              "--groups",
              std::move(groups),
              "--config",
              (folder_ / "fleet.yaml").string()};
    start();
  }
  HostProcess(const HostProcess&) = delete;
  HostProcess& operator=(const HostProcess&) = delete;
  ~HostProcess() { end(SIGKILL); }

  void start() {
    std::vector<char*> argv;
    for (std::string& word : words_) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string log = (folder_ / "log").string();
    child_ = ::fork();
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644), STDERR_FILENO);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
  }
  // The exit code, or -signal.
  int end(int signal) {
    if (child_ <= 0) return 0;
    int status = 0;
    ::kill(child_, signal);
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  void freeze() const { ::kill(child_, SIGSTOP); }
  void thaw() const { ::kill(child_, SIGCONT); }
  std::string log() const { return tests::read_file(folder_ / "log"); }
  std::filesystem::path state() const { return folder_ / "state"; }

 private:
  tests::TemporaryFolder folder_;
  std::string name_;
  std::vector<std::string> words_;
  pid_t child_ = -1;
};

// Sends what the test says and keeps what comes.
class Wire {
 public:
  explicit Wire(int port, const std::string& id = "edge") : client_(settings(port, id)) {
    client_.connect(std::nullopt);
    REQUIRE(eventually([&] { return poll(), connected_; }, 30s));
  }
  void send(const Arrival& message) {
    REQUIRE(client_.publish({message.topic, message.payload, mqtt::Qos::at_least_once, false}));
  }
  void send_retained(const std::string& topic, const std::string& payload) {
    REQUIRE(client_.publish({topic, payload, mqtt::Qos::at_least_once, true}));
  }
  bool host_online() {
    poll();
    const auto state = sparkplug::parse_host_state(newest_["spBv1.0/STATE/loopwarden-A"]);
    return state && state->online;
  }
  // Messages on the topic since the last call.
  std::size_t count(const std::string& topic) {
    poll();
    return std::exchange(counts_[topic], 0);
  }
  std::string newest(const std::string& topic) {
    poll();
    return newest_[topic];
  }

 private:
  static mqtt::ClientSettings settings(int port, const std::string& id) {
    mqtt::ClientSettings s;
    s.broker = {"127.0.0.1", static_cast<std::uint16_t>(port), false};
    s.client_id = id;
    s.most_waiting = 100'000;
    s.subscriptions = {{"spBv1.0/STATE/+"}, {"spBv1.0/A/NCMD/+"}, {"spBv1.0/A/DCMD/+/+"}};
    return s;
  }
  void poll() {
    for (mqtt::Event& event : client_.events(1ms)) {
      if (event.kind == mqtt::Event::Kind::connected) connected_ = true;
      if (event.kind != mqtt::Event::Kind::message) continue;
      ++counts_[event.message.topic];
      newest_[event.message.topic] = event.message.payload;
    }
  }
  mqtt::Client client_;
  bool connected_ = false;
  std::map<std::string, std::size_t> counts_;
  std::map<std::string, std::string> newest_;
};

const std::string kPvRows =
    "SELECT count(*) FROM value v JOIN metric m ON m.id = v.metric_id WHERE m.name = 'pv'";
const std::string kPvDifferent =
    "SELECT count(DISTINCT v.number) FROM value v JOIN metric m ON m.id = v.metric_id WHERE m.name "
    "= 'pv'";

struct Plant {
  tests::MqttBroker broker;
  tests::Postgres database;
};

std::uint64_t now_ms() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

TEST_CASE("a box that is born, says values and an alarm, and dies, is in the database", "[plant]") {
  if (!installed()) return;
  Plant plant;
  HostProcess host(plant.database, plant.broker.port(), "host", "A", "evidence: {delay: 0}\n");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  EdgeMessages edge;
  edge.time_ms = now_ms();
  wire.send(edge.nbirth());
  wire.send(edge.dbirth());
  wire.send(edge.pv(2.5));
  wire.send(edge.data({metric("", DataType::unknown, std::uint64_t{1}, edge.time_ms, 3),
                       metric("", DataType::unknown, 6.1, edge.time_ms, 4),
                       metric("", DataType::unknown, std::string("stiction"), edge.time_ms, 5)}));
  const tests::Postgres& database = plant.database;
  CHECK(eventually([&] { return database.ask_or_nothing(kPvRows) == "2"; }, 30s));
  CHECK(database.ask("SELECT tag FROM loop") == "10-FIC/101");
  CHECK(database.ask("SELECT online FROM loop") == "t");
  CHECK(database.ask("SELECT number FROM value_now WHERE name = 'pv'") == "2.5");
  CHECK(database.ask("SELECT percent FROM condition WHERE name = 'valve'") == "97");
  CHECK(eventually([&] { return database.ask("SELECT severity FROM worst_valve") == "6.1"; }, 30s));
  CHECK(database.ask("SELECT parts ->> 'effect' FROM explanation ORDER BY time DESC") ==
        "stiction");
  CHECK(database.ask("SELECT raised FROM alarm_rate") == "1");
  // The evidence of that alarm is asked for, and comes in two parts.
  const std::string asked = "spBv1.0/A/DCMD/box1/FIC-101";
  CHECK(eventually([&] { return wire.count(asked) == 1; }, 30s));
  CHECK(sparkplug::decode(wire.newest(asked)).find("request/evidence")->value ==
        sparkplug::Value(std::string("stiction")));
  for (const std::int64_t part : {1, 0}) {
    sparkplug::Metric file = metric("file/evidence.csv", DataType::file,
                                    sparkplug::Bytes{part == 0 ? "hel" : "lo"}, edge.time_ms);
    // sha256 of "hello"
    file.properties = {
        {"part", DataType::int32, part},
        {"parts", DataType::int32, std::int64_t{2}},
        {"sha256", DataType::string,
         std::string("2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824")}};
    wire.send(edge.data({file}));
  }
  CHECK(eventually([&] { return !database.ask("SELECT complete FROM evidence").empty(); }, 30s));
  wire.send(edge.ndeath());
  CHECK(eventually([&] { return database.ask("SELECT online FROM edge") == "f"; }, 30s));
  CHECK(database.ask("SELECT count(*) FROM silent_box") == "1");
  CHECK(host.end(SIGTERM) == 0);
  CHECK(eventually([&] { return !wire.host_online(); }, 30s));
  CHECK(database.ask("SELECT count(*) FROM lease") == "0");
}

TEST_CASE("what comes twice counts once, by whatever message it comes", "[plant]") {
  if (!installed()) return;
  Plant plant;
  const HostProcess host(plant.database, plant.broker.port(), "host");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  EdgeMessages edge;
  edge.time_ms = now_ms();
  wire.send(edge.nbirth());
  wire.send(edge.dbirth(1.0));
  const std::uint64_t taken_ms = edge.time_ms;
  const Arrival value = edge.pv(2.0);
  wire.send(value);
  wire.send(value);
  // From the edge's store, after a new connection: other bdSeq, other seq, the same time.
  ++edge.bd_seq;
  wire.send(edge.nbirth());
  wire.send(edge.dbirth(2.0, taken_ms));
  wire.send(edge.pv(2.0, true, taken_ms));
  wire.send(edge.pv(3.0));
  CHECK(eventually([&] { return plant.database.ask_or_nothing(kPvDifferent) == "3"; }, 30s));
  CHECK(plant.database.ask(kPvRows) == "3");
  CHECK(plant.database.ask("SELECT number FROM value_now WHERE name = 'pv'") == "3");
}

TEST_CASE("a lost birth and a gap make the host ask for a rebirth, not more often than it may",
          "[plant]") {
  if (!installed()) return;
  Plant plant;
  const HostProcess host(plant.database, plant.broker.port(), "host");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  EdgeMessages edge;
  edge.time_ms = now_ms();
  for (int i = 0; i < 20; ++i) wire.send(edge.pv(1.0));
  std::size_t asked = 0;
  const auto was_asked = [&] { return (asked += wire.count("spBv1.0/A/NCMD/box1")) > 0; };
  CHECK(eventually(was_asked, 30s));
  std::this_thread::sleep_for(1s);
  was_asked();
  CHECK(asked == 1);
  wire.send(edge.nbirth());
  wire.send(edge.dbirth());
  wire.send(edge.pv(7.0));
  CHECK(eventually([&] { return plant.database.ask_or_nothing(kPvRows) == "2"; }, 30s));
}

TEST_CASE("garbage changes nothing", "[plant]") {
  if (!installed()) return;
  Plant plant;
  const HostProcess host(plant.database, plant.broker.port(), "host");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  EdgeMessages edge;
  edge.time_ms = now_ms();
  wire.send(edge.nbirth());
  wire.send(edge.dbirth());
  for (const char* topic : {"spBv1.0/A/DDATA/box1/FIC-101", "spBv1.0/A/NBIRTH/box1",
                            "spBv1.0/A/NDEATH/x", "spBv1.0/A/DBIRTH/x/y"}) {
    for (const char* bytes : {"", "\xFF\xFF", "{\"metrics\": []}", "\x12\x02\x0A\x00"}) {
      wire.send({topic, bytes, 0, false});
    }
  }
  wire.send(edge.pv(5.0));
  CHECK(eventually(
      [&] {
        return plant.database.ask_or_nothing("SELECT number FROM value_now WHERE name = 'pv'") ==
               "5";
      },
      30s));
  CHECK(plant.database.ask("SELECT count(*) FROM edge") == "1");
}

TEST_CASE("while the database is away the spool keeps what comes, also over kill -9", "[plant]") {
  if (!installed()) return;
  Plant plant;
  HostProcess host(plant.database, plant.broker.port(), "host");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  EdgeMessages edge;
  edge.time_ms = now_ms();
  wire.send(edge.nbirth());
  wire.send(edge.dbirth(0.0));
  CHECK(eventually([&] { return plant.database.ask_or_nothing(kPvRows) == "1"; }, 30s));
  plant.database.stop();
  wire.send(edge.pv(1.0));
  const auto on_disk = [&] { return !std::filesystem::is_empty(host.state() / "spool/A"); };
  CHECK(eventually(on_disk, 30s));
  for (int n = 2; n <= 500; ++n) wire.send(edge.pv(n));
  std::this_thread::sleep_for(2s);
  CHECK(wire.host_online());
  host.end(SIGKILL);
  plant.database.start();
  host.start();
  CHECK(eventually([&] { return plant.database.ask(kPvRows) == "501"; }, 60s));
  CHECK(plant.database.ask(kPvDifferent) == "501");
  CHECK(plant.database.ask("SELECT number FROM value_now WHERE name = 'pv'") == "500");
  CHECK(eventually([&] { return std::filesystem::is_empty(host.state() / "spool/A"); }, 30s));
}

TEST_CASE("edges are told to keep what they have before the spool is full", "[plant]") {
  if (!installed()) return;
  Plant plant;
  const HostProcess host(plant.database, plant.broker.port(), "host", "A", "spool: 16\n");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  plant.database.stop();
  EdgeMessages edge;
  edge.time_ms = now_ms();
  wire.send(edge.nbirth());
  wire.send(edge.dbirth());
  const std::string large(100'000, 'x');
  for (int i = 0; i < 140; ++i) {
    wire.send(edge.data({metric("", DataType::unknown, large, edge.time_ms, 2)}));
  }
  CHECK(eventually([&] { return !wire.host_online(); }, 30s));
  plant.database.start();
  CHECK(eventually([&] { return wire.host_online(); }, 60s));
}

TEST_CASE(
    "the host's state is retained; its will has the time of its birth, its goodbye a newer one",
    "[plant]") {
  if (!installed()) return;
  Plant plant;
  const std::string topic = "spBv1.0/STATE/loopwarden-A";
  HostProcess host(plant.database, plant.broker.port(), "host");
  {
    Wire wire(plant.broker.port());
    REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  }
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 30s));
  const auto birth = sparkplug::parse_host_state(wire.newest(topic));
  host.end(SIGKILL);
  REQUIRE(eventually([&] { return !wire.host_online(); }, 30s));
  const auto will = sparkplug::parse_host_state(wire.newest(topic));
  CHECK(will->time_ms == birth->time_ms);
  host.start();
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  const auto next = sparkplug::parse_host_state(wire.newest(topic));
  CHECK(next->time_ms > birth->time_ms);
  CHECK(host.end(SIGTERM) == 0);
  REQUIRE(eventually([&] { return !wire.host_online(); }, 30s));
  CHECK(sparkplug::parse_host_state(wire.newest(topic))->time_ms > next->time_ms);
}

TEST_CASE("a state of a later time at the broker makes the host connect anew with one still later",
          "[plant]") {
  if (!installed()) return;
  Plant plant;
  Wire wire(plant.broker.port());
  const std::string topic = "spBv1.0/STATE/loopwarden-A";
  const std::uint64_t later = now_ms() + 3'600'000;
  wire.send_retained(topic, to_text(sparkplug::HostState{false, later}));
  const HostProcess host(plant.database, plant.broker.port(), "host");
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  CHECK(eventually([&] { return sparkplug::parse_host_state(wire.newest(topic))->time_ms > later; },
                   60s));
  // The late will of an older connection does not stand.
  wire.send_retained(topic, to_text(sparkplug::HostState{false, later - 5}));
  CHECK(eventually([&] { return wire.host_online(); }, 30s));
}

TEST_CASE("a group has one owner; a second host takes over within 10 s of its death", "[plant]") {
  if (!installed()) return;
  Plant plant;
  HostProcess first(plant.database, plant.broker.port(), "first");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  HostProcess second(plant.database, plant.broker.port(), "second");
  const std::string owner = plant.database.ask("SELECT owner FROM lease");
  std::this_thread::sleep_for(5s);
  CHECK(plant.database.ask("SELECT owner FROM lease") == owner);
  CHECK(wire.host_online());
  first.end(SIGKILL);
  CHECK(eventually([&] { return !wire.host_online(); }, 30s));
  CHECK(eventually([&] { return wire.host_online(); }, 60s));
  CHECK(plant.database.ask("SELECT owner FROM lease") != owner);
  CHECK_THAT(second.log(), Catch::Contains("served from now on"));
}

TEST_CASE("an owner that was stopped for long finds its group with another and lets it be",
          "[plant]") {
  if (!installed()) return;
  Plant plant;
  HostProcess first(plant.database, plant.broker.port(), "first");
  Wire wire(plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  const HostProcess second(plant.database, plant.broker.port(), "second");
  const std::string owner = plant.database.ask("SELECT owner FROM lease");
  first.freeze();
  CHECK(eventually([&] { return plant.database.ask("SELECT owner FROM lease") != owner; }, 60s));
  CHECK(eventually([&] { return wire.host_online(); }, 60s));
  first.thaw();
  CHECK(eventually([&] { return first.log().find("another host has it") != std::string::npos; },
                   60s));
  CHECK(eventually([&] { return wire.host_online(); }, 60s));
  CHECK(plant.database.ask("SELECT owner FROM lease") != owner);
}

TEST_CASE("migrations are applied once, whoever begins", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  std::vector<std::thread> programs;
  std::atomic<int> applied{0};
  for (int i = 0; i < 4; ++i) {
    programs.emplace_back([&] {
      applied += fleet::migrate(*fleet::open_database({database.url(), {}}));
    });
  }
  for (std::thread& program : programs) program.join();
  CHECK(applied == 4);
  const auto connection = fleet::open_database({database.url(), {}});
  pqxx::nontransaction(*connection).exec("INSERT INTO migration(number) VALUES(99)");
  CHECK_THROWS_WITH(fleet::migrate(*connection), Catch::Contains("newer"));
}

TEST_CASE("partitions are made ahead, take in what lay outside, and go when they are old",
          "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  const auto exec = [&](const std::string& sql) { pqxx::nontransaction(*connection).exec(sql); };
  exec(
      "INSERT INTO value VALUES(1, now() + interval '2 days', 7), (1, now() - interval '100 days', "
      "8)");
  fleet::keep_partitions(*connection, {});
  CHECK(database.ask("SELECT count(*) FROM value_rest") == "0");
  CHECK(database.ask("SELECT count(*) FROM value") == "1");
  CHECK(database.ask("SELECT count(*) FROM pg_inherits WHERE inhparent = 'value'::regclass") ==
        "6");
  exec("SELECT make_partition('value', 'time', 'day', now() - interval '40 days')");
  exec("INSERT INTO value VALUES(1, now() - interval '40 days', 9)");
  CHECK(fleet::keep_partitions(*connection, {}) == 1);
  CHECK(database.ask("SELECT count(*) FROM value") == "1");
}

TEST_CASE("the decimated history is that of the values, also of those that come late", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  fleet::keep_partitions(*connection, {});
  const auto exec = [&](const std::string& sql) { pqxx::nontransaction(*connection).exec(sql); };
  exec(R"(INSERT INTO edge(group_name, name) VALUES('A', 'box1');
    INSERT INTO device(edge_id, name, tag) VALUES(1, 'FIC', 'FIC');
    INSERT INTO metric(device_id, name, type) VALUES(1, 'pv', 'Double');
    INSERT INTO value SELECT 1, date_bin('15 minutes', now(), 'epoch') - interval '1 hour' + n * interval '1 minute', n
      FROM generate_series(0, 9) n;
    INSERT INTO history_waiting SELECT 1, date_bin('15 minutes', now(), 'epoch') - interval '1 hour')");
  CHECK(fleet::decimate_history(*connection, "B", 10) == 0);
  CHECK(fleet::decimate_history(*connection, "A", 10) == 1);
  CHECK(database.ask("SELECT (count, mean, low, high, last)::text FROM history_decimated") ==
        "(10,4.5,0,9,9)");
  exec(R"(INSERT INTO value SELECT 1, bucket + interval '14 minutes', 100 FROM history_decimated;
    INSERT INTO history_waiting SELECT 1, bucket FROM history_decimated)");
  CHECK(fleet::decimate_history(*connection, "", 10) == 1);
  CHECK(database.ask("SELECT (count, high, last)::text FROM history_decimated") == "(11,100,100)");
}

TEST_CASE("an alarm is now what its newest change says, also where an older one comes later",
          "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  const auto exec = [&](const std::string& sql) { pqxx::nontransaction(*connection).exec(sql); };
  const auto change = [&](const char* hours, const char* state) {
    exec(fmt::format(
        "INSERT INTO alarm VALUES(1, 'stiction', now() - {} * interval '1 hour', '{}', 5)", hours,
        state));
  };
  exec(R"(INSERT INTO edge(group_name, name) VALUES('A', 'box1');
    INSERT INTO device(edge_id, name, tag) VALUES(1, 'FIC', 'FIC'))");
  change("9", "unacknowledged");
  change("2", "acknowledged");
  CHECK(database.ask("SELECT state FROM alarm_now") == "acknowledged");
  change("5", "normal");
  CHECK(database.ask("SELECT state FROM alarm_now") == "acknowledged");
  change("4", "unacknowledged");
  CHECK(database.ask("SELECT round(extract(epoch FROM now() - since) / 3600) FROM worst_valve") ==
        "4");
  CHECK(database.ask("SELECT sum(raised) FROM alarm_rate") == "2");
  exec("DELETE FROM alarm");  // too old to be kept
  CHECK(database.ask("SELECT count(*) FROM worst_valve WHERE severity = 5") == "1");
  change("1", "normal");
  CHECK(database.ask("SELECT count(*) FROM worst_valve") == "0");
}

TEST_CASE("a box differs from what most of its group have", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  // A: two of three have one configuration. B: two of four have, which is no rule.
  pqxx::nontransaction(*connection).exec(R"(
    INSERT INTO edge(group_name, name) SELECT g, g || n FROM (VALUES('A', 3), ('B', 4)) s(g, m), generate_series(1, m) n;
    INSERT INTO device(edge_id, name, tag) SELECT id, '', '' FROM edge;
    INSERT INTO metric(device_id, name, type) SELECT id, unnest(ARRAY['version', 'config_hash', 'model_hash']), 'String' FROM device;
    INSERT INTO latest SELECT m.id, now(), CASE m.name WHEN 'config_hash' THEN greatest(substr(e.name, 2)::integer, 2) END,
        CASE m.name WHEN 'version' THEN CASE e.name WHEN 'B3' THEN '1' ELSE '2' END WHEN 'model_hash' THEN CASE e.name WHEN 'A2' THEN 'x' ELSE 'y' END END, false
      FROM metric m JOIN device d ON d.id = m.device_id JOIN edge e ON e.id = d.edge_id)");
  const auto boxes = [&](const char* which) {
    return database.ask(fmt::format(
        "SELECT string_agg(edge, ' ' ORDER BY edge) FROM box_version WHERE {}_differs", which));
  };
  CHECK(boxes("version") == "B3");
  CHECK(boxes("model") == "A2");
  CHECK(boxes("config") == "A3");
}

TEST_CASE("a lease belongs to one owner until it runs out or is given back", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  CHECK(fleet::hold_lease(*connection, "A", "one"));
  CHECK(fleet::hold_lease(*connection, "A", "one"));
  CHECK_FALSE(fleet::hold_lease(*connection, "A", "two"));
  CHECK(fleet::hold_lease(*connection, "B", "two"));
  pqxx::nontransaction(*connection).exec("UPDATE lease SET until = now() WHERE group_name = 'A'");
  CHECK(fleet::hold_lease(*connection, "A", "two"));
  CHECK_FALSE(fleet::hold_lease(*connection, "A", "one"));
  fleet::release_lease(*connection, "A", "one");
  CHECK_FALSE(fleet::hold_lease(*connection, "A", "one"));
  fleet::release_lease(*connection, "A", "two");
  CHECK(fleet::hold_lease(*connection, "A", "one"));
}

}  // namespace
}  // namespace loopwarden::plant_test
