// SPDX-License-Identifier: Apache-2.0
// loopwarden-fleet with a real Mosquitto and a real PostgreSQL, started by the test, and simulated
// edges. If one of them is not installed, the tests are left out with a notice.
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pqxx/pqxx>

#include "services/database/connection.hpp"
#include "services/fleet/host/lease.hpp"
#include "services/fleet/host/maintenance.hpp"
#include "services/fleet/host/migrations.hpp"
#include "services/fleet/host/writer.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/net/sparkplug/host_state.hpp"
#include "model/alarm/alarm.hpp"
#include "tests/services/fleet/host/messages.hpp"
#include "tests/support/mqtt_broker.hpp"
#include "tests/support/postgres.hpp"
#include "tests/support/program.hpp"

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
  HostProcess(const tests::Postgres& database, int broker_port, std::string groups = "A",
              const std::string& more = "") {
    tests::write_file(folder_ / "fleet.yaml", "state_directory: " + (folder_ / "state").string() +
                                                  "\nmetrics: {port: 0}\n" + more);
    program_.emplace(
        std::vector<std::string>{LOOPWARDEN_BIN_DIR "/loopwarden-fleet", "--broker",
                                 "mqtt://127.0.0.1:" + std::to_string(broker_port), "--database",
                                 database.url(), "--groups", std::move(groups), "--config",
                                 (folder_ / "fleet.yaml").string()},
        folder_ / "log");
    start();
  }

  void start() { program_->start(); }
  int end(int signal) { return program_->end(signal); }
  void freeze() const { program_->signal(SIGSTOP); }
  void thaw() const { program_->signal(SIGCONT); }
  std::string log() const { return program_->log(); }
  std::filesystem::path state() const { return folder_ / "state"; }

 private:
  tests::TemporaryFolder folder_;
  std::optional<tests::Program> program_;
};

// Sends the messages of the test and keeps the received ones.
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
  // Returns the messages on the topic since the last call.
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

std::uint64_t now_ms() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

struct Plant {
  tests::MqttBroker broker;
  tests::Postgres database;
};

// A plant whose host is online, with an edge before its birth.
struct Served : Plant {
  explicit Served(const std::string& groups = "A", const std::string& more = "")
      : host(database, broker.port(), groups, more) {
    REQUIRE(online());
    edge.time_ms = now_ms();
  }
  void bear(double pv = 1.0) {
    wire.send(edge.nbirth());
    wire.send(edge.dbirth(pv));
  }
  bool online() {
    return eventually([&] { return wire.host_online(); }, 60s);
  }
  bool offline() {
    return eventually([&] { return !wire.host_online(); }, 60s);
  }
  bool has(const std::string& sql, const std::string& answer) const {
    return eventually([&] { return database.ask_or_nothing(sql) == answer; }, 60s);
  }
  std::string owner() const { return database.ask("SELECT owner FROM lease"); }

  HostProcess host;
  Wire wire{broker.port()};
  EdgeMessages edge;
};

const std::string kNewestPv = "SELECT number FROM value_now WHERE name = 'pv'";

TEST_CASE("a box's birth, values, alarm and death are in the database", "[plant]") {
  if (!installed()) return;
  Served plant("A", "evidence: {delay: 0}\n");
  plant.bear();
  plant.wire.send(plant.edge.pv(2.5));
  plant.wire.send(plant.edge.data(
      {metric("", DataType::unknown, std::uint64_t{1}, plant.edge.time_ms, 3),
       metric("", DataType::unknown, 6.1, plant.edge.time_ms, 4),
       metric("", DataType::unknown, std::string("stiction"), plant.edge.time_ms, 5),
       metric("", DataType::unknown, std::string("unacknowledged"), plant.edge.time_ms, 7)}));
  const tests::Postgres& database = plant.database;
  CHECK(plant.has(kPvRows, "2"));
  CHECK(database.ask("SELECT tag FROM loop") == "10-FIC/101");
  CHECK(database.ask("SELECT online FROM loop") == "t");
  CHECK(database.ask(kNewestPv) == "2.5");
  CHECK(database.ask("SELECT percent FROM condition WHERE name = 'valve'") == "97");
  CHECK(plant.has("SELECT severity FROM worst_valve WHERE alarm = 'stiction'", "6.1"));
  CHECK(database.ask("SELECT state FROM worst_valve WHERE alarm = 'bad_pv'") == "unacknowledged");
  CHECK(database.ask("SELECT parts ->> 'effect' FROM explanation ORDER BY time DESC") ==
        "stiction");
  CHECK(database.ask("SELECT raised FROM alarm_rate") == "2");
  // The host requests the evidence of the valve's alarm, which arrives in two parts. A process
  // alarm has no evidence.
  CHECK(database.ask("SELECT string_agg(value, ' ') FROM request") == "stiction");
  const std::string asked = "spBv1.0/A/DCMD/box1/FIC-101";
  CHECK(eventually([&] { return plant.wire.count(asked) == 1; }, 30s));
  CHECK(sparkplug::decode(plant.wire.newest(asked)).find("request/evidence")->value ==
        sparkplug::Value(std::string("stiction")));
  for (const std::int64_t part : {1, 0}) {
    sparkplug::Metric file = metric("file/evidence.csv", DataType::file,
                                    sparkplug::Bytes{part == 0 ? "hel" : "lo"}, plant.edge.time_ms);
    // sha256 of "hello"
    file.properties = {
        {"part", DataType::int32, part},
        {"parts", DataType::int32, std::int64_t{2}},
        {"sha256", DataType::string,
         std::string("2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824")}};
    plant.wire.send(plant.edge.data({file}));
  }
  CHECK(eventually([&] { return !database.ask("SELECT complete FROM evidence").empty(); }, 30s));
  plant.wire.send(plant.edge.ndeath());
  CHECK(plant.has("SELECT online FROM edge", "f"));
  CHECK(database.ask("SELECT count(*) FROM silent_box") == "1");
  CHECK(plant.host.end(SIGTERM) == 0);
  CHECK(plant.offline());
  CHECK(database.ask("SELECT count(*) FROM lease") == "0");
}

TEST_CASE("a value received twice counts once, in any kind of message", "[plant]") {
  if (!installed()) return;
  Served plant;
  plant.bear(1.0);
  const std::uint64_t taken_ms = plant.edge.time_ms;
  const Arrival value = plant.edge.pv(2.0);
  plant.wire.send(value);
  plant.wire.send(value);
  // The same values from the edge's store, after a new connection, with another bdSeq and seq.
  ++plant.edge.bd_seq;
  plant.wire.send(plant.edge.nbirth());
  plant.wire.send(plant.edge.dbirth(2.0, taken_ms));
  plant.wire.send(plant.edge.pv(2.0, true, taken_ms));
  plant.wire.send(plant.edge.pv(3.0));
  CHECK(plant.has(kPvDifferent, "3"));
  CHECK(plant.database.ask(kPvRows) == "3");
  CHECK(plant.database.ask(kNewestPv) == "3");
}

TEST_CASE("after a lost birth or a gap the host requests a rebirth, at a limited rate", "[plant]") {
  if (!installed()) return;
  Served plant;
  for (int i = 0; i < 20; ++i) plant.wire.send(plant.edge.pv(1.0));
  std::size_t asked = 0;
  const auto was_asked = [&] { return (asked += plant.wire.count("spBv1.0/A/NCMD/box1")) > 0; };
  CHECK(eventually(was_asked, 30s));
  std::this_thread::sleep_for(1s);
  was_asked();
  CHECK(asked == 1);
  plant.bear();
  plant.wire.send(plant.edge.pv(7.0));
  CHECK(plant.has(kPvRows, "2"));
}

TEST_CASE("garbage has no effect", "[plant]") {
  if (!installed()) return;
  Served plant;
  plant.bear();
  for (const char* topic : {"spBv1.0/A/DDATA/box1/FIC-101", "spBv1.0/A/NBIRTH/box1",
                            "spBv1.0/A/NDEATH/x", "spBv1.0/A/DBIRTH/x/y"}) {
    for (const char* bytes : {"", "\xFF\xFF", "{\"metrics\": []}", "\x12\x02\x0A\x00"}) {
      plant.wire.send({topic, bytes, 0, false});
    }
  }
  plant.wire.send(plant.edge.pv(5.0));
  CHECK(plant.has(kNewestPv, "5"));
  CHECK(plant.database.ask("SELECT count(*) FROM edge") == "1");
}

TEST_CASE("while the database is away the spool keeps all messages, also over kill -9", "[plant]") {
  if (!installed()) return;
  Served plant;
  plant.bear(0.0);
  CHECK(plant.has(kPvRows, "1"));
  plant.database.stop();
  plant.wire.send(plant.edge.pv(1.0));
  const auto on_disk = [&] { return !std::filesystem::is_empty(plant.host.state() / "spool/A"); };
  CHECK(eventually(on_disk, 30s));
  for (int n = 2; n <= 500; ++n) plant.wire.send(plant.edge.pv(n));
  std::this_thread::sleep_for(2s);
  CHECK(plant.wire.host_online());
  plant.host.end(SIGKILL);
  plant.database.start();
  plant.host.start();
  CHECK(plant.has(kPvRows, "501"));
  CHECK(plant.database.ask(kPvDifferent) == "501");
  CHECK(plant.database.ask(kNewestPv) == "500");
  CHECK(eventually([&] { return std::filesystem::is_empty(plant.host.state() / "spool/A"); }, 30s));
}

TEST_CASE("edges are asked to store their messages before the spool is full", "[plant]") {
  if (!installed()) return;
  Served plant("A", "spool: 16\n");
  plant.database.stop();
  plant.bear();
  const std::string large(100'000, 'x');
  for (int i = 0; i < 140; ++i) {
    plant.wire.send(plant.edge.data({metric("", DataType::unknown, large, plant.edge.time_ms, 2)}));
  }
  CHECK(plant.offline());
  plant.database.start();
  CHECK(plant.online());
}

TEST_CASE(
    "the host's STATE is retained; its will has the time of its birth, its goodbye a newer time",
    "[plant]") {
  if (!installed()) return;
  Served plant;
  const std::string topic = "spBv1.0/STATE/loopwarden-A";
  HostProcess& host = plant.host;
  Wire wire(plant.broker.port(), "later");
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

TEST_CASE("a later STATE at the broker makes the host reconnect with a still later time",
          "[plant]") {
  if (!installed()) return;
  Plant plant;
  Wire wire(plant.broker.port());
  const std::string topic = "spBv1.0/STATE/loopwarden-A";
  const std::uint64_t later = now_ms() + 3'600'000;
  wire.send_retained(topic, to_text(sparkplug::HostState{false, later}));
  const HostProcess host(plant.database, plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  CHECK(eventually([&] { return sparkplug::parse_host_state(wire.newest(topic))->time_ms > later; },
                   60s));
  // The host replaces the late will of an older connection.
  wire.send_retained(topic, to_text(sparkplug::HostState{false, later - 5}));
  CHECK(eventually([&] { return wire.host_online(); }, 30s));
}

TEST_CASE("a STATE with the greatest possible time doesn't keep the host from its group",
          "[plant]") {
  if (!installed()) return;
  Plant plant;
  Wire wire(plant.broker.port());
  const std::string topic = "spBv1.0/STATE/loopwarden-A";
  wire.send_retained(topic, R"({"online":false,"timestamp":18446744073709551615})");
  const HostProcess host(plant.database, plant.broker.port());
  REQUIRE(eventually([&] { return wire.host_online(); }, 60s));
  CHECK_THAT(host.log(), !Catch::Contains("connecting again"));
}

TEST_CASE("a group has one owner; a second host takes over within 10 s of its death", "[plant]") {
  if (!installed()) return;
  Served plant;
  HostProcess second(plant.database, plant.broker.port());
  const std::string owner = plant.owner();
  std::this_thread::sleep_for(5s);
  CHECK(plant.owner() == owner);
  CHECK(plant.wire.host_online());
  plant.host.end(SIGKILL);
  CHECK(plant.offline());
  CHECK(plant.online());
  CHECK(plant.owner() != owner);
  CHECK_THAT(second.log(), Catch::Contains("served from now on"));
}

TEST_CASE("an owner that was stopped for long leaves its group to the new owner", "[plant]") {
  if (!installed()) return;
  Served plant;
  const HostProcess second(plant.database, plant.broker.port());
  const std::string owner = plant.owner();
  plant.host.freeze();
  CHECK(eventually([&] { return plant.owner() != owner; }, 60s));
  CHECK(plant.online());
  plant.host.thaw();
  CHECK(eventually(
      [&] { return plant.host.log().find("another host has it") != std::string::npos; }, 60s));
  CHECK(plant.online());
  CHECK(plant.owner() != owner);
}

// Stores while its primary host is away, and sends recent messages again, as loopwarden-edge does.
class StoringEdge {
 public:
  explicit StoringEdge(Served& plant) : plant_(plant) {}

  void say(double pv) {
    values_.push_back({pv, plant_.edge.time_ms++});
    if (!plant_.wire.host_online()) {
      online_ = false;
    } else if (!online_ || plant_.wire.count("spBv1.0/A/NCMD/box1") > 0) {
      come();
    } else {
      plant_.wire.send(plant_.edge.pv(pv, false, values_.back().time_ms));
    }
  }
  bool online() const { return online_; }
  std::size_t said() const { return values_.size(); }

 private:
  struct Taken {
    double pv;
    std::uint64_t time_ms;
  };
  void come() {
    ++plant_.edge.bd_seq;
    online_ = true;
    plant_.wire.send(plant_.edge.nbirth());
    plant_.wire.send(plant_.edge.dbirth(values_.back().pv, values_.back().time_ms));
    for (const Taken& value : values_) {
      plant_.wire.send(plant_.edge.pv(value.pv, true, value.time_ms));
    }
  }

  Served& plant_;
  std::vector<Taken> values_;
  bool online_ = false;
};

TEST_CASE("a host that starts later gets its share of the groups, without losses", "[plant]") {
  if (!installed()) return;
  Served plant("B,A");
  StoringEdge edge(plant);
  const auto say_for = [&](std::chrono::seconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    for (; std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(10ms)) {
      edge.say(static_cast<double>(edge.said()));
    }
  };
  const std::string owner_of_a = "SELECT owner FROM lease WHERE group_name = 'A'";
  const std::string first = plant.database.ask(owner_of_a);
  say_for(2s);
  HostProcess second(plant.database, plant.broker.port(), "A,B");
  const auto handed_over = [&] {
    say_for(1s);
    const std::string owner = plant.database.ask(owner_of_a);
    return !owner.empty() && owner != first && edge.online();
  };
  CHECK(eventually(handed_over, 60s));
  say_for(5s);
  CHECK(plant.has(kPvDifferent, std::to_string(edge.said())));
  CHECK(plant.database.ask(kPvRows) == std::to_string(edge.said()));
  CHECK_THAT(plant.host.log(), Catch::Contains("group A: handed over to another host"));
  CHECK(plant.database.ask("SELECT owner FROM lease WHERE group_name = 'B'") == first);
  // The shares are even, so no group moves until one of the hosts stops.
  CHECK(second.end(SIGTERM) == 0);
  CHECK(plant.has("SELECT count(*) FROM lease WHERE owner = '" + first + "'", "2"));
}

TEST_CASE("migrations are applied once, whichever host starts first", "[plant]") {
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
  CHECK(applied == 9);
  const auto connection = fleet::open_database({database.url(), {}});
  pqxx::nontransaction(*connection).exec("INSERT INTO migration(number) VALUES(99)");
  CHECK_THROWS_WITH(fleet::migrate(*connection), Catch::Contains("newer"));
}

TEST_CASE("the state with the newest time decides, in any order of arrival", "[plant]") {
  if (!installed()) return;
  using sparkplug::DataType;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  fleet::Writer writer(*connection, {});
  fleet::Ingest ingest;
  tests::EdgeMessages edge;
  const auto write = [&](const fleet::Arrival& arrival) {
    fleet::Batch batch = ingest.prepare({arrival}, static_cast<std::int64_t>(edge.time_ms));
    writer.write(batch);
    ingest.commit(std::move(batch));
  };
  // Makes a stored message with an older time than the birth.
  const auto alarm = [&](std::uint64_t state, std::uint64_t time_ms) {
    sparkplug::Metric metric = tests::metric("", DataType::unknown, state, time_ms, 3);
    metric.historical = true;
    return edge.data({metric});
  };
  const auto now = [&] {
    return database.ask("SELECT state FROM alarm_now WHERE name = 'stiction'");
  };
  write(edge.nbirth());
  edge.time_ms += 1'800'000;
  const std::uint64_t born_ms = edge.time_ms;
  write(edge.dbirth(5.0));  // normal, the first state of an alarm: no change
  write(alarm(1, born_ms - 1'200'000));
  CHECK(now() == "normal");
  CHECK(database.ask("SELECT count(*) FROM alarm WHERE name = 'stiction'") == "2");
  // The clearing between both arrives last.
  write(alarm(0, born_ms - 600'000));
  CHECK(now() == "normal");
  // A stored value from before the birth is not the newest either, although the birth has the same
  // value.
  write(edge.dbirth(5.0));
  write(edge.pv(7.0, true, born_ms - 300'000));
  CHECK(database.ask("SELECT number FROM value_now WHERE name = 'pv'") == "5");

  // The reverse case: active at the newest time, although an earlier clearing arrives later.
  write(alarm(1, born_ms + 60'000));
  write(alarm(1, born_ms + 180'000));
  write(alarm(0, born_ms + 120'000));
  CHECK(now() == "unacknowledged");
}

TEST_CASE(
    "partitions are made in advance, take over rows from outside, and are dropped when they are "
    "old",
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

TEST_CASE("the decimated history matches the values, also late ones", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  fleet::keep_partitions(*connection, {});
  const auto exec = [&](const std::string& sql) { pqxx::nontransaction(*connection).exec(sql); };
  exec(R"(INSERT INTO edge(group_name, name) VALUES('A', 'box1');
    INSERT INTO device(edge_id, name, tag) VALUES(1, 'FIC', 'FIC');
    INSERT INTO metric(device_id, name, type) VALUES(1, 'pv', 'Double');
    INSERT INTO value SELECT 1, date_bin('15 minutes', now(), 'epoch') - interval '1 hour' + n *
        interval '1 minute', n
      FROM generate_series(0, 9) n;
    INSERT INTO history_waiting SELECT 1, date_bin('15 minutes', now(), 'epoch') - interval
        '1 hour')");
  CHECK(fleet::decimate_history(*connection, "B", 10) == 0);
  CHECK(fleet::decimate_history(*connection, "A", 10) == 1);
  CHECK(database.ask("SELECT (count, mean, low, high, last)::text FROM history_decimated") ==
        "(10,4.5,0,9,9)");
  exec(R"(INSERT INTO value SELECT 1, bucket + interval '14 minutes', 100 FROM history_decimated;
    INSERT INTO history_waiting SELECT 1, bucket FROM history_decimated)");
  CHECK(fleet::decimate_history(*connection, "", 10) == 1);
  CHECK(database.ask("SELECT (count, high, last)::text FROM history_decimated") == "(11,100,100)");
}

TEST_CASE("the newest change gives the state of an alarm, also if an older one arrives later",
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

// Writes batches of messages to a separate database.
struct Written {
  tests::Postgres database;
  std::unique_ptr<pqxx::connection> connection = fleet::open_database({database.url(), {}});
  fleet::Ingest ingest;
  EdgeMessages edge;

  Written() { fleet::migrate(*connection); }
  void write(const std::vector<Arrival>& arrivals) {
    fleet::Batch batch = ingest.prepare(arrivals, static_cast<std::int64_t>(now_ms()));
    fleet::Writer(*connection, {.evidence_delay_s = 0}).write(batch);
    ingest.commit(std::move(batch));
  }
  Arrival alarm(std::uint64_t state, std::uint64_t time_ms) {
    return edge.data({metric("", DataType::unknown, state, time_ms, 3)});
  }
  std::string states() const {
    return database.ask("SELECT string_agg(state, ' ' ORDER BY time) FROM alarm");
  }
};

TEST_CASE("an alarm raised and cleared within one batch is cleared", "[plant]") {
  if (!installed()) return;
  using alarm::AlarmState;
  const auto code = [](AlarmState state) { return static_cast<std::uint64_t>(state); };
  const std::uint64_t normal = code(AlarmState::normal);
  const std::uint64_t raised = code(AlarmState::unacknowledged);
  const std::uint64_t seen = code(AlarmState::acknowledged);
  Written plant;
  const std::uint64_t start = plant.edge.time_ms;
  plant.write({plant.edge.nbirth(), plant.edge.dbirth()});
  SECTION("in order") {
    plant.write({plant.alarm(raised, start + 100), plant.alarm(raised, start + 200),
                 plant.alarm(normal, start + 300)});
    CHECK(plant.states() == "unacknowledged normal");
    CHECK(plant.database.ask("SELECT count(*) FROM request") == "1");
  }
  SECTION("the newer message first: the time of the alarm decides") {
    plant.write({plant.alarm(normal, start + 300), plant.alarm(raised, start + 100)});
    CHECK(plant.states() == "unacknowledged normal");
  }
  SECTION("around an existing change") {
    plant.write({plant.alarm(seen, start + 200)});
    plant.write({plant.alarm(raised, start + 100), plant.alarm(normal, start + 300),
                 plant.alarm(raised, start + 400), plant.alarm(normal, start + 500)});
    CHECK(plant.states() == "unacknowledged acknowledged normal unacknowledged normal");
  }
  SECTION("the same batch twice") {
    for (int times = 0; times < 2; ++times) {
      plant.write({plant.alarm(raised, start + 100), plant.alarm(normal, start + 300)});
    }
    CHECK(plant.states() == "unacknowledged normal");
  }
  CHECK(plant.database.ask("SELECT state FROM alarm_now") == "normal");
}

TEST_CASE("an alarm that was suppressed before it was raised is counted, as on the box",
          "[plant]") {
  if (!installed()) return;
  using alarm::AlarmState;
  Written plant;
  plant.write({plant.edge.nbirth(), plant.edge.dbirth()});
  std::uint64_t at_ms = plant.edge.time_ms;
  const auto raised_after = [&](AlarmState before) {
    for (const AlarmState state : {before, AlarmState::unacknowledged}) {
      plant.write({plant.alarm(static_cast<std::uint64_t>(state), at_ms += 100)});
    }
    return plant.database.ask("SELECT raised FROM alarm_raised ORDER BY time DESC LIMIT 1");
  };
  CHECK(raised_after(AlarmState::suppressed) == "t");
  CHECK(raised_after(AlarmState::normal) == "t");
  CHECK(raised_after(AlarmState::shelved) == "f");
  CHECK(raised_after(AlarmState::acknowledged) == "f");
}

TEST_CASE("a birth that resets a value within one batch is the newest", "[plant]") {
  if (!installed()) return;
  Written plant;
  plant.write({plant.edge.nbirth(), plant.edge.dbirth(5.0)});
  plant.write({plant.edge.pv(6.0), plant.edge.dbirth(5.0), plant.edge.dbirth(5.0)});
  CHECK(plant.database.ask(kNewestPv) == "5");
  CHECK(plant.database.ask(kPvRows) == "3");
}

TEST_CASE("evidence is requested until it is complete, or until the box reports a lack",
          "[plant]") {
  if (!installed()) return;
  Written plant;
  plant.write({plant.edge.nbirth(),
               plant.edge.birth_of({metric("order/result", DataType::string, std::string())})});
  const auto exec = [&](const std::string& sql) {
    pqxx::nontransaction(*plant.connection).exec(sql);
  };
  exec(
      "INSERT INTO request(device_id, metric, value) SELECT id, 'request/evidence', 'stiction' "
      "FROM device WHERE name <> ''");
  int asked = 0;
  bool goes = true;
  const auto ask = [&] {
    asked = 0;
    fleet::ask_due_requests(*plant.connection, "A", [&](const fleet::DueRequest& request) {
      CHECK(request.value == "stiction");
      ++asked;
      return goes;
    });
    return asked;
  };
  const auto later = [&](const char* minutes) {
    exec(fmt::format("UPDATE request SET sent = sent - {} * interval '1 minute'", minutes));
  };
  const auto file = [&](const char* name, const char* bytes, const char* sha256,
                        std::int64_t part) {
    sparkplug::Metric one = metric(std::string("file/") + name, DataType::file,
                                   sparkplug::Bytes{bytes}, plant.edge.time_ms);
    one.properties = {{"part", DataType::int32, part},
                      {"parts", DataType::int32, std::int64_t{2}},
                      {"files", DataType::int32, std::int64_t{2}},
                      {"folder", DataType::string, std::string("e1")},
                      {"request", DataType::string, std::string("stiction")},
                      {"sha256", DataType::string, std::string(sha256)}};
    return plant.edge.data({one});
  };
  const char* hello = "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824";
  const char* abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  const auto open = [&] {
    return plant.database.ask("SELECT count(*) FROM request WHERE done IS NULL");
  };
  // The request could not be sent, so it is still due.
  goes = false;
  CHECK(ask() == 1);
  goes = true;
  CHECK(ask() == 1);
  CHECK(ask() == 0);
  SECTION("a part was lost: a second request completes it") {
    plant.write({file("record.csv", "hel", hello, 0), file("twin.yaml", "ab", abc, 0),
                 file("twin.yaml", "c", abc, 1)});
    CHECK(open() == "1");
    later("11");
    CHECK(ask() == 1);
    later("11");
    CHECK(ask() == 0);
    plant.write({file("twin.yaml", "ab", abc, 0), file("record.csv", "lo", hello, 1)});
    CHECK(open() == "0");
    CHECK(plant.database.ask("SELECT count(*) FROM evidence WHERE complete IS NOT NULL") == "2");
  }
  SECTION("the box has none") {
    plant.write({plant.edge.data(
        {metric("order/result", DataType::string,
                std::string("request/evidence stiction: refused: no such evidence"))})});
    CHECK(plant.database.ask("SELECT answer FROM request") == "no such evidence");
  }
  SECTION("no answer at all: the requests end") {
    for (int tries = 1; tries < 6; ++tries) {
      later("400");
      CHECK(ask() == 1);
    }
    later("400");
    CHECK(ask() == 0);
    CHECK(plant.database.ask("SELECT answer FROM request") == "never answered");
  }
  later("9999");
  CHECK(ask() == 0);
}

TEST_CASE("a box that differs from most of its group is listed", "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  // Group A: two of three have one configuration. Group B: two of four have it, which is no
  // majority.
  pqxx::nontransaction(*connection).exec(R"(
    INSERT INTO edge(group_name, name) SELECT g, g || n FROM (VALUES('A', 3), ('B', 4)) s(g, m),
        generate_series(1, m) n;
    INSERT INTO device(edge_id, name, tag) SELECT id, '', '' FROM edge;
    INSERT INTO metric(device_id, name, type) SELECT id, unnest(ARRAY['version', 'config_hash',
        'model_hash']), 'String' FROM device;
    INSERT INTO latest SELECT m.id, now(), CASE m.name WHEN 'config_hash' THEN
        greatest(substr(e.name, 2)::integer, 2) END,
        CASE m.name WHEN 'version' THEN CASE e.name WHEN 'B3' THEN '1' ELSE '2' END WHEN
            'model_hash' THEN CASE e.name WHEN 'A2' THEN 'x' ELSE 'y' END END, false
      FROM metric m JOIN device d ON d.id = m.device_id JOIN edge e ON e.id = d.edge_id)");
  const auto boxes = [&](const char* which) {
    return database.ask(fmt::format(
        "SELECT string_agg(edge, ' ' ORDER BY edge) FROM box_version WHERE {}_differs", which));
  };
  CHECK(boxes("version") == "B3");
  CHECK(boxes("model") == "A2");
  CHECK(boxes("config") == "A3");
}

TEST_CASE("a lease belongs to one owner until it expires or is released", "[plant]") {
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

TEST_CASE("a host learns for each group the fewest leases of another host that can serve it",
          "[plant]") {
  if (!installed()) return;
  const tests::Postgres database;
  const auto connection = fleet::open_database({database.url(), {}});
  fleet::migrate(*connection);
  using Fewest = std::map<std::string, int>;
  CHECK(fleet::announce(*connection, "one", {"A", "B"}).empty());
  CHECK(fleet::announce(*connection, "two", {"B", "C"}) == Fewest{{"A", 0}, {"B", 0}});
  CHECK(fleet::hold_lease(*connection, "A", "one"));
  CHECK(fleet::hold_lease(*connection, "B", "one"));
  CHECK(fleet::announce(*connection, "two", {"B", "C"}) == Fewest{{"A", 2}, {"B", 2}});
  CHECK(fleet::announce(*connection, "three", {"B"}) == Fewest{{"A", 2}, {"B", 0}, {"C", 0}});
  // A host that was silent for the time of a lease no longer counts.
  pqxx::nontransaction(*connection).exec("UPDATE host SET until = now() WHERE owner = 'two'");
  CHECK(fleet::announce(*connection, "three", {"B"}) == Fewest{{"A", 2}, {"B", 2}});
  fleet::withdraw(*connection, "one");
  CHECK(fleet::announce(*connection, "three", {"B"}).empty());
  CHECK(database.ask("SELECT count(*) FROM lease") == "0");
}

}  // namespace
}  // namespace loopwarden::plant_test
