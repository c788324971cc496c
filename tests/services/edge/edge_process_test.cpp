// SPDX-License-Identifier: Apache-2.0
// The program itself between a scripted daemon and a real Mosquitto.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "services/edge/store.hpp"
#include "services/fleet/host/ingest.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/net/sparkplug/host_state.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/fake_daemon.hpp"
#include "tests/support/mqtt_broker.hpp"
#include "tests/support/program.hpp"
#include "tests/support/slow_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace edge_process_test {

using namespace std::chrono_literals;
using namespace loopwarden;
using loopwarden::test::eventually;
using sparkplug::DataType;
using sparkplug::MessageType;
using sparkplug::Metric;
using sparkplug::Payload;
using sparkplug::Topic;
using sparkplug::Value;
using tests::FakeDaemon;
using tests::MqttBroker;

// Receives all of spBv1.0 by the rules of loopwarden-fleet.
class Host {
 public:
  explicit Host(mqtt::ClientSettings settings) : client_(std::move(settings)) {
    client_.connect(std::nullopt);
    listen();
  }
  explicit Host(int port) : Host(settings(port)) {}

  static mqtt::ClientSettings settings(int port) {
    mqtt::ClientSettings s;
    s.broker = {"127.0.0.1", static_cast<std::uint16_t>(port), false};
    s.client_id = "host";
    s.keep_alive = 5s;
    s.reconnect_min = 20ms;
    s.reconnect_max = 100ms;
    s.subscriptions = {{"spBv1.0/#", mqtt::Qos::at_least_once}};
    return s;
  }

  struct Heard {
    Topic topic;
    Payload payload;  // of data with the names of the birth
    bool retain;
    mqtt::Qos qos;
    bool missed;  // an earlier message, or the birth of its device, is missing
  };
  std::deque<Heard> heard;

  bool node_online() const {
    const auto edge = ingest_.edges().find(kBox);
    return edge != ingest_.edges().end() && edge->second.tracker.born();
  }
  std::size_t devices_online() const {
    return node_online() ? ingest_.edges().at(kBox).books.size() - 1 : 0;
  }

  // Waits until the broker forwards all later messages to this host.
  void listen() {
    ++probe_;
    std::chrono::steady_clock::time_point again{};
    REQUIRE(until([&] {
      // A message sent on a connection that was about to break never arrives.
      if (client_.connected() && std::chrono::steady_clock::now() >= again) {
        client_.publish({kProbe, std::to_string(probe_), mqtt::Qos::at_least_once, false});
        again = std::chrono::steady_clock::now() + 1s;
      }
      return probe_heard_ == probe_;
    }));
  }
  // Receives until the condition is true. Returns false after the time-out.
  bool until(const std::function<bool()>& condition, std::chrono::seconds patience = 60s) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      fetch(100ms);
    }
    return true;
  }
  // Returns the first message from `from` on that satisfies `wanted`, or null if it does not
  // arrive. Earlier messages stay in `heard`.
  const Heard* await(const std::function<bool(const Heard&)>& wanted) {
    const Heard* found = nullptr;
    until([&] {
      for (; found == nullptr && next_ < heard.size(); ++next_) {
        if (wanted(heard[next_])) found = &heard[next_];
      }
      return found != nullptr;
    });
    return found;
  }
  const Heard* await(MessageType type) {
    return await([type](const Heard& h) { return h.topic.type == type; });
  }
  // Returns the data message in which the metric has this value.
  const Heard* await_value(const std::string& metric, const Value& value) {
    return await([&](const Heard& h) {
      const Metric* m = h.payload.find(metric);
      return m != nullptr && m->value == value;
    });
  }
  void fetch(std::chrono::milliseconds patience) {
    for (mqtt::Event& event : client_.events(patience)) take(event);
  }
  void say(const std::string& topic, const std::string& payload, bool retain = false) {
    REQUIRE(client_.publish({topic, payload, mqtt::Qos::at_least_once, retain}));
  }
  void command(MessageType type, const std::string& device, std::vector<Metric> metrics) {
    say(sparkplug::to_text(Topic{"plant", type, "box", device}),
        sparkplug::encode({.time_ms = 1, .seq = {}, .metrics = std::move(metrics)},
                          sparkplug::Types::sent));
  }
  void be_online(bool online, std::uint64_t time_ms) {
    say(sparkplug::state_topic("scada"), sparkplug::to_text(sparkplug::HostState{online, time_ms}),
        true);
  }

 private:
  static constexpr const char* kProbe = "spBv1.0/probe";  // no topic of Sparkplug

  void take(mqtt::Event& event) {
    if (event.kind == mqtt::Event::Kind::disconnected) client_.connect(std::nullopt);
    if (event.kind != mqtt::Event::Kind::message) return;
    if (event.message.topic == kProbe) probe_heard_ = std::stoi(event.message.payload);
    const auto topic = sparkplug::parse_topic(event.message.topic);
    if (!topic || topic->type == MessageType::ncmd || topic->type == MessageType::dcmd) return;
    Payload payload = sparkplug::decode(event.message.payload);
    check_birth(*topic, payload);
    ++now_ms_;
    fleet::Batch batch =
        ingest_.prepare({{event.message.topic, event.message.payload, now_ms_, false}}, now_ms_);
    const fleet::EdgeTracker& tracker = batch.edges.at(kBox).tracker;
    const bool missed = tracker.wants_rebirth() || tracker.waits() || batch.counts.garbage > 0;
    ingest_.commit(std::move(batch));
    give_names(*topic, payload);
    heard.push_back({*topic, std::move(payload), event.message.retain, event.message.qos, missed});
  }
  // Each metric of a birth has a name and a type. An alias denotes one metric of the whole node.
  void check_birth(const Topic& topic, const Payload& payload) {
    if (topic.type != MessageType::nbirth && topic.type != MessageType::dbirth) return;
    std::erase_if(aliases_, [&](const auto& taken) {
      return topic.type == MessageType::nbirth || taken.second == topic.device;
    });
    std::set<std::string> names;
    for (const Metric& metric : payload.metrics) {
      CHECK_FALSE(metric.name.empty());
      CHECK(metric.type != DataType::unknown);
      CHECK(names.insert(metric.name).second);
      if (metric.alias) CHECK(aliases_.emplace(*metric.alias, topic.device).second);
    }
  }
  void give_names(const Topic& topic, Payload& payload) {
    const auto& books = ingest_.edges().at(kBox).books;
    const auto book = books.find(topic.device);
    for (Metric& metric : payload.metrics) {
      const fleet::MetricInfo* info = book == books.end() ? nullptr : book->second->find(metric);
      if (info == nullptr) continue;
      metric.name = info->name;
      metric.type = info->type;
      metric.value = sparkplug::retyped(std::move(metric.value), info->type);
    }
  }

  inline static const fleet::EdgeName kBox{"plant", "box"};
  mqtt::Client client_;
  fleet::Ingest ingest_;
  std::map<std::uint64_t, std::string> aliases_;  // and their device
  std::int64_t now_ms_ = 0;
  std::size_t next_ = 0;
  int probe_ = 0;
  int probe_heard_ = 0;
};

class Edge {
 public:
  // `more` is appended to edge.yaml. `broker` and `names` extend its sections broker and sparkplug.
  Edge(const std::filesystem::path& folder, const std::string& url, const std::string& more = "",
       const std::string& broker = "", const std::string& names = "") {
    tests::write_file(
        folder / "edge.yaml",
        "broker: {url: '" + url + "', keep_alive: 5, reconnect_min: 0.1, reconnect_max: 0.3" +
            broker + "}\nsparkplug: {group: plant, edge: box" + names +
            "}\nruntime_directory: " + folder.string() + "\nstore: {directory: " + folder.string() +
            ", resend_window: 30}\ndata: {interval: 0.2}\n" + more);
    program_.emplace(std::vector<std::string>{LOOPWARDEN_BIN_DIR "/loopwarden-edge", "--config",
                                              (folder / "edge.yaml").string()},
                     folder / "edge.log");
    start();
  }
  Edge(const std::filesystem::path& folder, const MqttBroker& broker, const std::string& more = "",
       const std::string& names = "")
      : Edge(folder, "mqtt://127.0.0.1:" + std::to_string(broker.port()), more, "", names) {}

  void start() { program_->start(); }
  int end(int number) { return program_->end(number); }
  void freeze() const { program_->signal(SIGSTOP); }
  void thaw() const { program_->signal(SIGCONT); }
  std::string log() const { return program_->log(); }

 private:
  std::optional<tests::Program> program_;
};

struct Plant {
  tests::TemporaryFolder folder;
  FakeDaemon daemon{folder.path(), {"FIC-101", "FIC-102"}};
  MqttBroker broker;
  Host host{broker.port()};

  // Waits until the edge has polled the daemon `times` more times.
  void look(std::size_t times) {
    const std::size_t end = daemon.looks() + times;
    REQUIRE(eventually([&] { return daemon.looks() >= end; }, 60s));
  }
  // `back` restarts the broker. Without a primary host the edge reconnects only after the host
  // listens.
  void bring_back(const Edge& edge, const std::function<void()>& back) {
    edge.freeze();
    back();
    host.listen();
    edge.thaw();
  }
};

Metric wanted(std::string name, DataType type, Value value) {
  Metric metric;
  metric.name = std::move(name);
  metric.type = type;
  metric.value = std::move(value);
  return metric;
}

std::int64_t bd_seq(const Host::Heard& heard) {
  return std::get<std::int64_t>(heard.payload.find("bdSeq")->value);
}

TEST_CASE("births are sent first, with all metrics; then the changes", "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  const Host::Heard* birth = plant.host.await(MessageType::nbirth);
  REQUIRE(birth != nullptr);
  CHECK(birth == &plant.host.heard.front());
  CHECK(birth->payload.seq == 0);
  CHECK(birth->payload.time_ms);
  CHECK(birth->qos == mqtt::Qos::at_most_once);
  CHECK_FALSE(birth->retain);
  CHECK(bd_seq(*birth) == 0);
  CHECK(birth->payload.find("Node Control/Rebirth")->value == Value(false));
  CHECK_FALSE(birth->payload.find("Node Control/Rebirth")->alias);
  CHECK(birth->payload.find("config_hash")->value == Value(std::uint64_t{77}));
  for (const Metric& m : birth->payload.metrics) {
    CHECK(m.time_ms);
    CHECK(m.type != DataType::unknown);
  }
  const Host::Heard* first = plant.host.await(MessageType::dbirth);
  REQUIRE(first != nullptr);
  CHECK(first->payload.seq == 1);
  CHECK(first->topic.device == "FIC-101");
  CHECK(first->payload.find("pv")->value == Value(5.0));
  CHECK(first->payload.find("pv")->property("engUnit")->value == Value(std::string("L/min")));
  CHECK(first->payload.find("pv")->property("engHigh")->value == Value(10.0));
  for (const Metric& m : first->payload.metrics)
    CHECK((m.alias && m.time_ms && m.type != DataType::unknown));
  const Host::Heard* second = plant.host.await(MessageType::dbirth);
  REQUIRE(second != nullptr);
  CHECK(second->topic.device == "FIC-102");
  plant.daemon.set("FIC-102", "pv", 6.0);
  plant.daemon.set("FIC-102", "mode", 0);
  const Host::Heard* data = plant.host.await_value("pv", 6.0);
  REQUIRE(data != nullptr);
  CHECK(data->topic == Topic{"plant", MessageType::ddata, "box", "FIC-102"});
  CHECK(data->qos == mqtt::Qos::at_most_once);
  CHECK_FALSE(data->retain);
  for (const Metric& m : data->payload.metrics) CHECK((m.alias && m.time_ms && !m.historical));
  CHECK(edge.end(SIGTERM) == 0);
  const Host::Heard* death = plant.host.await(MessageType::ndeath);
  REQUIRE(death != nullptr);
  CHECK(bd_seq(*death) == 0);
  CHECK_FALSE(death->payload.seq);
  for (const Host::Heard& h : plant.host.heard) CHECK_FALSE(h.missed);
}

TEST_CASE(
    "kill -9: the broker publishes the death of this birth; the next birth has the next bdSeq",
    "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  edge.end(SIGKILL);
  const Host::Heard* death = plant.host.await(MessageType::ndeath);
  REQUIRE(death != nullptr);
  CHECK(bd_seq(*death) == 0);
  CHECK(death->qos == mqtt::Qos::at_least_once);
  CHECK_FALSE(death->retain);
  CHECK(death->payload.metrics.size() == 1);
  CHECK_FALSE(plant.host.node_online());
  edge.start();
  const Host::Heard* birth = plant.host.await(MessageType::nbirth);
  REQUIRE(birth != nullptr);
  CHECK(bd_seq(*birth) == 1);
}

TEST_CASE("a host asks for births and gets all of them, with the same bdSeq, from seq 0",
          "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.daemon.set("FIC-101", "pv", 7.0);
  REQUIRE(plant.host.await_value("pv", 7.0) != nullptr);
  plant.host.command(MessageType::ncmd, "",
                     {wanted("Node Control/Rebirth", DataType::boolean, true)});
  const Host::Heard* again = plant.host.await(MessageType::nbirth);
  REQUIRE(again != nullptr);
  CHECK(bd_seq(*again) == 0);
  CHECK(again->payload.seq == 0);
  const Host::Heard* device = plant.host.await(MessageType::dbirth);
  REQUIRE(device != nullptr);
  CHECK(device->payload.find("pv")->value == Value(7.0));
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  // A payload that is no command has no effect.
  plant.host.say("spBv1.0/plant/NCMD/box", "\x01 rubbish");
  plant.host.command(MessageType::ncmd, "", {wanted("none", DataType::boolean, true)});
  plant.daemon.set("FIC-101", "pv", 8.0);
  REQUIRE(plant.host.await_value("pv", 8.0) != nullptr);
}

TEST_CASE("a storm of rebirth requests is answered by a few births, including the last request",
          "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  const auto ask = [&] {
    plant.host.command(MessageType::ncmd, "",
                       {wanted("bdSeq", DataType::int64, std::int64_t{0}),
                        wanted("Node Control/Rebirth", DataType::boolean, true)});
  };
  for (int i = 0; i < 200; ++i) {
    ask();
    plant.host.fetch(2ms);
  }
  plant.daemon.set("FIC-101", "pv", 9.0);
  REQUIRE(plant.host.await_value("pv", 9.0) != nullptr);
  ask();
  const auto birth_of_now = [](const Host::Heard& h) {
    const Metric* pv = h.payload.find("pv");
    return h.topic.type == MessageType::dbirth && pv != nullptr && pv->value == Value(9.0);
  };
  CHECK(plant.host.await(birth_of_now) != nullptr);
  const auto births =
      std::count_if(plant.host.heard.begin(), plant.host.heard.end(),
                    [](const Host::Heard& h) { return h.topic.type == MessageType::nbirth; });
  CHECK(births < 20);  // few, also on a slow machine
}

// PV of the loop as the host received it. Counts per source time how often it arrived, and whether
// it was always marked as historical.
struct Received {
  std::map<double, int> times_by_value;
  std::vector<double> historical;  // of the newest connection, in the order of arrival
};

Received received(const Host& host) {
  Received all;
  for (const Host::Heard& h : host.heard) {
    if (h.topic.type == MessageType::nbirth) all.historical.clear();
    const Metric* pv = h.topic.device == "FIC-101" ? h.payload.find("pv") : nullptr;
    if (pv == nullptr) continue;
    ++all.times_by_value[std::get<double>(pv->value)];
    if (pv->historical) all.historical.push_back(std::get<double>(pv->value));
  }
  return all;
}

TEST_CASE(
    "after a broker dies, all values measured meanwhile arrive, marked as historical, oldest first",
    "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  // The edge reads each value once before the next is set.
  int step = 0;
  const auto next_value = [&] {
    plant.daemon.set("FIC-101", "pv", 1.0 + 0.25 * ++step);
    plant.look(2);
  };
  for (int i = 0; i < 3; ++i) next_value();
  plant.broker.kill();
  for (int i = 0; i < 10; ++i) next_value();
  plant.bring_back(edge, [&] { plant.broker.start(); });
  REQUIRE(plant.host.await(MessageType::nbirth) != nullptr);
  for (int i = 0; i < 3; ++i) next_value();
  // The newest values may arrive before the old ones.
  CHECK(plant.host.until([&] {
    const Received now = received(plant.host);
    return now.historical.size() >= 10 &&
           now.times_by_value.size() >= static_cast<std::size_t>(step);
  }));
  const Received all = received(plant.host);
  for (int i = 1; i <= step; ++i) {
    INFO("value " << i);
    CHECK(all.times_by_value.count(1.0 + 0.25 * i) == 1);
  }
  CHECK(all.historical.size() >= 10);
  CHECK(std::is_sorted(all.historical.begin(), all.historical.end()));
  CHECK_FALSE(std::any_of(plant.host.heard.begin(), plant.host.heard.end(),
                          [](const Host::Heard& h) { return h.missed; }));
}

TEST_CASE("the store outlives the program", "[edge]") {
  Plant plant;
  plant.broker.kill();
  Edge edge(plant.folder.path(), plant.broker);
  for (const double pv : {6.0, 7.0, 8.0}) {
    plant.daemon.set("FIC-101", "pv", pv);
    plant.look(4);
  }
  CHECK(edge.end(SIGTERM) == 0);
  // Without a primary host the edge publishes its history on every connection.
  plant.broker.start();
  plant.host.listen();
  edge.start();
  REQUIRE(plant.host.await_value("pv", 8.0) != nullptr);
  CHECK(plant.host.until([&] { return received(plant.host).historical.size() >= 3; }));
  const Received all = received(plant.host);
  CHECK(all.times_by_value.count(6.0) == 1);
  CHECK(all.times_by_value.count(7.0) == 1);
}

TEST_CASE("with a slow disk under the store the edge continues and publishes all measured values",
          "[edge]") {
  Plant plant;
  plant.broker.kill();
  tests::SlowDisk disk;
  disk.slow(tests::SlowDisk::File::edge_store, 200ms);
  Edge edge(plant.folder.path(), plant.broker);
  for (const double pv : {6.0, 7.0, 8.0}) {
    plant.daemon.set("FIC-101", "pv", pv);
    plant.look(4);
  }
  CHECK(edge.end(SIGTERM) == 0);
  CHECK(disk.calls() > 0);
  plant.broker.start();
  plant.host.listen();
  edge.start();
  REQUIRE(plant.host.await_value("pv", 8.0) != nullptr);
  CHECK(plant.host.until([&] { return received(plant.host).historical.size() >= 3; }));
  const Received all = received(plant.host);
  CHECK(all.times_by_value.count(6.0) == 1);
  CHECK(all.times_by_value.count(7.0) == 1);
}

TEST_CASE("a broker that accepts and hangs delays only its own messages", "[edge]") {
  const tests::TemporaryFolder folder;
  FakeDaemon daemon{folder.path(), {"FIC-101"}};
  const tests::SilentBroker silent;
  Edge edge(folder.path(), "mqtt://127.0.0.1:" + std::to_string(silent.port()));
  // The edge polls the daemon during the whole time-out of the broker, and after it.
  const auto gives_up = [&](int times) {
    const auto seen = [&] {
      const std::string log = edge.log();
      int count = 0;
      for (std::size_t at = log.find("warning broker:"); at != std::string::npos;
           at = log.find("warning broker:", at + 1)) {
        ++count;
      }
      return count >= times;
    };
    return eventually(seen, 90s);
  };
  REQUIRE(eventually([&] { return daemon.looks() >= 3; }, 60s));
  const std::size_t before = daemon.looks();
  REQUIRE(gives_up(1));
  CHECK(daemon.looks() > before + 5);
  CHECK(gives_up(2));
  CHECK(edge.end(SIGTERM) == 0);
}

TEST_CASE("a broker that hangs while it is connected: all measured values arrive", "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.broker.hang();
  int step = 0;
  // Longer than the time-out of the broker.
  while (edge.log().find("warning broker:") == std::string::npos && step < 400) {
    plant.daemon.set("FIC-101", "pv", 0.1 + 0.0625 * (++step % 150));
    plant.look(2);
  }
  REQUIRE(step < 150);
  plant.bring_back(edge, [&] { plant.broker.go_on(); });
  // The value of the first birth counts too.
  CHECK(plant.host.until(
      [&] { return received(plant.host).times_by_value.size() > static_cast<std::size_t>(step); }));
  const Received all = received(plant.host);
  for (int i = 1; i <= step; ++i) {
    INFO("value " << i << " of " << step);
    CHECK(all.times_by_value.count(static_cast<double>(static_cast<float>(0.1 + 0.0625 * i))) == 1);
  }
}

TEST_CASE(
    "without its primary host it is silent and stores; when the host is lost it sends its death "
    "and returns",
    "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker, "", ", primary_host: scada");
  REQUIRE(
      eventually([&] { return edge.log().find("broker: connected") != std::string::npos; }, 60s));
  plant.daemon.set("FIC-101", "pv", 2.0);
  plant.look(4);
  plant.host.fetch(100ms);
  CHECK(plant.host.heard.empty());
  plant.host.be_online(true, 1000);
  const Host::Heard* birth = plant.host.await(MessageType::nbirth);
  REQUIRE(birth != nullptr);
  const std::int64_t number = bd_seq(*birth);
  const Host::Heard* stored = plant.host.await([](const Host::Heard& h) {
    const Metric* pv = h.payload.find("pv");
    return pv != nullptr && pv->historical && pv->value == Value(2.0);
  });
  CHECK(stored != nullptr);
  // An older STATE, such as the will of a replaced connection.
  plant.host.be_online(false, 999);
  plant.daemon.set("FIC-101", "pv", 3.0);
  REQUIRE(plant.host.await_value("pv", 3.0) != nullptr);
  plant.host.be_online(false, 1000);
  const Host::Heard* death = plant.host.await(MessageType::ndeath);
  REQUIRE(death != nullptr);
  CHECK(bd_seq(*death) == number);
  plant.host.be_online(true, 2000);
  const Host::Heard* back = plant.host.await(MessageType::nbirth);
  REQUIRE(back != nullptr);
  CHECK(bd_seq(*back) == number + 1);
}

TEST_CASE("when the daemon restarts, its loops die and are born again, and the node stays alive",
          "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.daemon.stop();
  REQUIRE(plant.host.await(MessageType::ddeath) != nullptr);
  REQUIRE(plant.host.await(MessageType::ddeath) != nullptr);
  CHECK(plant.host.devices_online() == 0);
  REQUIRE(plant.host.await_value("daemon/online", false) != nullptr);
  plant.daemon.start();
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  REQUIRE(plant.host.await_value("daemon/online", true) != nullptr);
  // Changed loops or units cause new births of the whole node.
  plant.daemon.set_unit("m3/h");
  plant.daemon.set_box("config_hash", 78);
  REQUIRE(plant.host.await(MessageType::nbirth) != nullptr);
  const Host::Heard* birth = plant.host.await(MessageType::dbirth);
  REQUIRE(birth != nullptr);
  CHECK(birth->payload.find("pv")->property("engUnit")->value == Value(std::string("m3/h")));
  for (const Host::Heard& h : plant.host.heard) CHECK_FALSE(h.missed);
}

TEST_CASE("a node without its daemon sends its birth, and again with its loops", "[edge]") {
  Plant plant;
  plant.daemon.stop();
  Edge edge(plant.folder.path(), plant.broker);
  const Host::Heard* birth = plant.host.await(MessageType::nbirth);
  REQUIRE(birth != nullptr);
  CHECK(birth->payload.find("daemon/online")->value == Value(false));
  plant.daemon.start();
  REQUIRE(plant.host.await(MessageType::nbirth) != nullptr);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
}

TEST_CASE("orders reach the daemon only if edge.yaml has them, and their outcome is published",
          "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker, "orders: true\n");
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.host.command(
      MessageType::dcmd, "FIC-101",
      {wanted("sp", DataType::float32, 6.5), wanted("mode", DataType::uint16, std::uint64_t{1})});
  REQUIRE(plant.host.await_value("order/result", std::string("sp 6.5, mode 1: done")) != nullptr);
  const auto orders = plant.daemon.orders();
  REQUIRE(orders.size() == 1);
  CHECK(orders[0].at("loop") == "FIC-101");
  CHECK(orders[0].at("set_point") == 6.5);
  CHECK(orders[0].at("user") == "sparkplug");
  plant.daemon.refuse_orders("the loop is in automatic");
  Metric by_alias = wanted("", DataType::float32, 30.0);
  by_alias.alias = plant.host.heard.at(1).payload.find("output")->alias;
  plant.host.command(MessageType::dcmd, "FIC-101", {by_alias});
  REQUIRE(plant.host.await_value("order/result",
                                 std::string("output 30: refused: the loop is in automatic")) !=
          nullptr);
  plant.host.command(MessageType::dcmd, "FIC-101", {wanted("pv", DataType::float32, 1.0)});
  REQUIRE(plant.host.await_value(
              "order/result",
              std::string("refused: pv is not a command, or lacks a valid value")) != nullptr);
  plant.host.command(MessageType::dcmd, "none", {wanted("sp", DataType::float32, 1.0)});
  plant.daemon.refuse_orders("");
  for (const char* tag : {"FIC-101", "FIC-102"}) {
    plant.daemon.set_alarm(tag, {{"alarm", "stiction"},
                                 {"state", "unacknowledged"},
                                 {"severity_percent", 6.5},
                                 {"raised_ms", 5}});
    plant.daemon.set(tag, "alarm_stiction", 1);
  }
  REQUIRE(plant.host.await_value("alarm/stiction/state", std::string("unacknowledged")) != nullptr);
  plant.host.command(MessageType::ncmd, "", {wanted("acknowledge_all", DataType::boolean, true)});
  for (int i = 0; i < 2; ++i) {
    REQUIRE(plant.host.await_value("order/result", std::string("acknowledge_stiction: done")) !=
            nullptr);
  }
  // One request for both, so that the daemon waits for its disk once.
  const auto orders_then = plant.daemon.orders();
  CHECK(std::count_if(orders_then.begin(), orders_then.end(),
                      [](const auto& order) { return order.at("request") != "set"; }) == 1);
  CHECK(plant.daemon.orders().back().at("request") == "acknowledge_all");
}

TEST_CASE("without orders in edge.yaml no order is sent", "[edge]") {
  Plant plant;
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.host.command(MessageType::dcmd, "FIC-101", {wanted("sp", DataType::float32, 6.5)});
  REQUIRE(plant.host.await_value("order/result",
                                 std::string("sp 6.5: refused: edge.yaml has no orders: true")) !=
          nullptr);
  CHECK(plant.daemon.orders().empty());
}

TEST_CASE("evidence is sent in parts on request", "[edge]") {
  Plant plant;
  const auto evidence = plant.folder / "evidence/e1";
  tests::write_file(evidence / "evidence.json", R"({"loop": "FIC-101"})");
  const std::string record(150'000, 'r');
  tests::write_file(evidence / "record.csv", record);
  Edge edge(plant.folder.path(), plant.broker);
  REQUIRE(plant.host.await(MessageType::dbirth) != nullptr);
  plant.host.command(MessageType::dcmd, "FIC-101",
                     {wanted("request/evidence", DataType::string, std::string("e1"))});
  std::string whole;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Host::Heard* part = plant.host.await([](const Host::Heard& h) {
      return h.topic.type == MessageType::ddata && h.payload.find("file/record.csv") != nullptr;
    });
    REQUIRE(part != nullptr);
    const Metric& file = *part->payload.find("file/record.csv");
    CHECK(file.property("part")->value == Value(i));
    CHECK(file.property("parts")->value == Value(std::uint64_t{3}));
    whole += std::get<sparkplug::Bytes>(file.value).data;
  }
  CHECK(whole == record);
  plant.host.command(MessageType::dcmd, "FIC-101",
                     {wanted("request/evidence", DataType::string, std::string("../x"))});
  CHECK(plant.host.await_value("order/result",
                               std::string("request/evidence ../x: refused: no such evidence")) !=
        nullptr);
}

TEST_CASE("TLS with the test's own certificate", "[edge]") {
  const tests::TemporaryFolder folder;
  FakeDaemon daemon{folder.path(), {"FIC-101"}};
  const tests::Certificates certificates;
  MqttBroker broker(certificates.broker_lines());
  Edge edge(folder.path(), "mqtts://127.0.0.1:" + std::to_string(broker.port()), "",
            ", ca_file: " + certificates.file("ca.crt") +
                ", certificate_file: " + certificates.file("client.crt") +
                ", key: {file: " + certificates.file("client.key") + "}");
  mqtt::ClientSettings settings = Host::settings(broker.port());
  settings.broker.tls = true;
  settings.ca_file = certificates.file("ca.crt");
  settings.certificate_file = certificates.file("client.crt");
  settings.key.file = certificates.file("client.key");
  Host host(settings);
  // The edge may have sent its birth before the host subscribed.
  host.command(MessageType::ncmd, "", {wanted("Node Control/Rebirth", DataType::boolean, true)});
  CHECK(host.await(MessageType::dbirth) != nullptr);
}

TEST_CASE("--check reports errors; a bad configuration gives 78, a bad command line 64", "[edge]") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "edge.yaml",
                    "broker: {url: 'mqtt://b'}\nsparkplug: {group: a, edge: b}\nspark: 1\n");
  const std::string program = LOOPWARDEN_BIN_DIR "/loopwarden-edge";
  const auto bad =
      tests::run(program + " --check --config " + (folder / "edge.yaml").string() + " 2>&1");
  CHECK(bad.exit_code == 78);
  CHECK_THAT(bad.text, Catch::Contains("edge.yaml:3:1: error: unknown key 'spark'"));
  CHECK(tests::run(program + " 2>&1").exit_code == 64);
  CHECK(tests::run(program + " --config /none 2>&1").exit_code == 78);
  CHECK(tests::run(program + " --version").exit_code == 0);
}

TEST_CASE("a store of a later version ends the program with 78 and a message", "[edge]") {
  const tests::TemporaryFolder folder;
  { const edge::Store store(folder / "store.sqlite", 1'000'000); }
  sqlite::Database(folder / "store.sqlite", sqlite::Access::write, 1s)
      .execute("PRAGMA user_version=2");
  Edge edge(folder.path(), "mqtt://127.0.0.1:1");
  CHECK(edge.end(0) == 78);
  CHECK_THAT(edge.log(), Catch::Contains("store.sqlite is a store of version 2"));
}

}  // namespace edge_process_test
