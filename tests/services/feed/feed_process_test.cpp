// SPDX-License-Identifier: Apache-2.0
// The program runs between a real Mosquitto, on which a Python edge node publishes, and the real
// daemon.
#include <pwd.h>
#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/daemon_process.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/mqtt_broker.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace feed_process_test {

using namespace loopwarden;
using loopwarden::test::eventually;
using nlohmann::json;
using test::ForeignProcess;
using tests::DaemonProcess;
using tests::MqttBroker;

const std::string kHead = R"(control: elsewhere
sample_time: 0.1
process_variable: {unit: m3/h, range: [0, 40], max_age: 0.5}
output: {unit: "%", range: [0, 100]}
recording: {enabled: false}
io:
  backend: feed
)";
const std::string kTopics = "loop: FIC-205\n" + kHead + R"(  pv: {feed: "mqtt:FIC205.PV"}
  co: {feed: "mqtt:FIC205.OP"}
)";
const std::string kSparkplug = "loop: FIC-206\n" + kHead + R"(  pv: {feed: "mqtt:FIC206.PV"}
  co: {feed: "mqtt:FIC206.OP"}
  sp: {feed: "mqtt:FIC206.SP"}
  mode: {feed: "mqtt:FIC206.MODE", automatic: [1], manual: [0]}
)";

struct Rig {
  explicit Rig(const std::string& more = "")
      : daemon("real_time: {priority: 0, lock_memory: false}\nfeeders: {mqtt: {user: " +
                   std::string(::getpwuid(::getuid())->pw_name) + "}}\n",
               {{"loops.d/205.yaml", kTopics}, {"loops.d/206.yaml", kSparkplug}}),
        feeder({LOOPWARDEN_BIN_DIR "/loopwarden-feed", "--config", file("feed.yaml")}, file("log")),
        edge("sparkplug_edge.py", {std::to_string(broker.port()), "plant", "e1", "dev"}) {
    tests::write_file(folder / "feed.yaml",
                      "broker: {url: 'mqtt://127.0.0.1:" + std::to_string(broker.port()) +
                          "', reconnect_min: 0.1, reconnect_max: 0.2}\n" +
                          "runtime_directory: " + daemon.folder().string() + R"(
alive_interval: 0.1
topics:
  - {name: FIC205.PV, topic: plant/fic205, value: /pv, time: /t, quality: /q}
  - {name: FIC205.OP, topic: plant/fic205/op}
  - {name: nobody, topic: plant/fic205/op}
metrics:
  - {name: FIC206.PV, group: plant, edge: e1, device: dev, metric: PV}
  - {name: FIC206.OP, group: plant, edge: e1, device: dev, metric: OP}
  - {name: FIC206.SP, group: plant, edge: e1, device: dev, metric: SP}
  - {name: FIC206.MODE, group: plant, edge: e1, device: dev, metric: MODE}
)" + more);
    daemon.start();
    feeder.start();
    REQUIRE(eventually([&] { return says("broker: connected"); }));
  }

  std::string file(const std::string& name) const { return (folder / name).string(); }
  bool says(const std::string& text) const { return feeder.log().find(text) != std::string::npos; }
  bool is(const std::string& loop, const char* key, const json& value) {
    return eventually(
        [&] {
          const json now = daemon.loop(loop);
          return now.contains(key) && now.at(key) == value;  // absent before the first cycle
        },
        std::chrono::seconds(20));
  }
  // A value with the present time as its time stamp.
  void publish(double pv, const std::string& quality = "good") {
    const auto now =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch());
    edge.command("publish plant/fic205 " +
                 json{{"pv", pv}, {"t", now.count()}, {"q", quality}}.dump());
    edge.command("publish plant/fic205/op 33");
  }
  json counters() { return daemon.status().at("daemon").at("feeders").at(0); }

  tests::TemporaryFolder folder;
  MqttBroker broker;
  DaemonProcess daemon;
  tests::Program feeder;
  ForeignProcess edge;
};

TEST_CASE("values of topics and of a foreign edge node reach watched loops", "[feed][process]") {
  Rig rig;
  rig.edge.command("connect");
  rig.publish(12.5);
  REQUIRE(rig.is("FIC-205", "pv", 12.5));
  CHECK(rig.is("FIC-205", "co", 33.0));
  CHECK(rig.is("FIC-206", "pv", 1.0));
  CHECK(rig.is("FIC-206", "mode", "AUTO"));
  // No new values, only signs of life.
  CHECK(rig.is("FIC-205", "pv_reason", "held"));
  CHECK(rig.is("FIC-205", "pv_quality", "good"));

  rig.edge.command("set PV 2.5");
  CHECK(rig.is("FIC-206", "pv", 2.5));
  rig.edge.command("set MODE 0");
  CHECK(rig.is("FIC-206", "mode", "MAN"));
  rig.edge.command("historical PV 39");
  rig.edge.command("set SP 3.5");
  CHECK(rig.is("FIC-206", "sp", 3.5));
  CHECK(rig.daemon.loop("FIC-206").at("pv") == 2.5);
  rig.edge.command("quality PV 500");
  CHECK(rig.is("FIC-206", "pv_reason", "said by the source"));
  rig.edge.command("set PV 4.5");
  CHECK(rig.is("FIC-206", "pv", 4.5));

  // A value that can't be read is bad and counted. The program continues.
  rig.edge.command("publish plant/fic205 no JSON");
  CHECK(rig.is("FIC-205", "pv_quality", "bad"));
  CHECK(rig.says("plant/fic205, for FIC205.PV: expected JSON"));
  rig.edge.command("publish spBv1.0/plant/DDATA/e1/dev no payload");
  rig.edge.command("publish spBv1.0/plant/DDATA/e1/stranger no payload");
  rig.publish(13.5);
  CHECK(rig.is("FIC-205", "pv", 13.5));
  rig.publish(14.5, "bad");
  CHECK(rig.is("FIC-205", "pv_reason", "said by the source"));
  CHECK(rig.counters().at("unknown_names") > 0);
  CHECK(rig.counters().at("bad_lines") == 0);

  // The edge node dies without a goodbye, and reconnects.
  rig.edge.command("drop");
  CHECK(rig.is("FIC-206", "pv_reason", "death of the source"));
  CHECK(rig.daemon.loop("FIC-206").at("pv").is_null());
  rig.edge.command("connect");
  CHECK(rig.is("FIC-206", "pv", 4.5));
  rig.edge.command("device_death");
  CHECK(rig.is("FIC-206", "pv_reason", "death of the source"));

  rig.publish(16.5);
  CHECK(rig.is("FIC-205", "pv", 16.5));

  // The feeder never wrote to the edge node.
  CHECK(rig.edge.state("commands") == "0");
  CHECK(rig.feeder.end(SIGTERM) == 0);
  CHECK(rig.says("bad payloads 3,"));
  CHECK(rig.says("historical 1,"));
  CHECK(rig.is("FIC-205", "pv_reason", "stale"));
}

TEST_CASE("values become bad and good again when broker, daemon and feeder stop and return",
          "[feed][process]") {
  Rig rig("ask_rebirth: true\n");
  rig.edge.command("connect");
  rig.publish(12.5);
  REQUIRE(rig.is("FIC-205", "pv", 12.5));
  REQUIRE(rig.is("FIC-206", "pv", 1.0));

  rig.broker.kill();
  CHECK(rig.is("FIC-205", "pv_reason", "link lost"));
  CHECK(rig.is("FIC-206", "pv_reason", "link lost"));
  // A daemon that starts without the broker is told so.
  rig.daemon.signal(SIGKILL);
  rig.daemon.wait_for_end();
  rig.daemon.start();
  CHECK(rig.is("FIC-205", "pv_reason", "link lost"));
  rig.edge.command("drop");
  rig.broker.start();
  // The birth was sent before or after the feeder returned. In both cases the feeder requests it.
  rig.edge.command("connect");
  CHECK(rig.is("FIC-206", "pv", 1.0));
  // The values published meanwhile are unknown.
  CHECK(rig.is("FIC-205", "pv_reason", "link lost"));
  rig.publish(15.5);
  CHECK(rig.is("FIC-205", "pv", 15.5));

  // A sequence number is missing, so births are requested.
  const std::string commands = rig.edge.state("commands");
  rig.edge.command("lose");
  rig.edge.command("set PV 5.5");
  CHECK(rig.is("FIC-206", "pv", 5.5));
  CHECK(eventually([&] { return rig.edge.state("commands") != commands; }));
  CHECK(rig.is("FIC-206", "pv_quality", "good"));

  // A restarted daemon receives the known values without a new message.
  rig.daemon.signal(SIGKILL);
  rig.daemon.wait_for_end();
  rig.daemon.start();
  CHECK(rig.is("FIC-205", "pv", 15.5));
  CHECK(rig.is("FIC-206", "pv", 5.5));

  rig.feeder.end(SIGKILL);
  CHECK(rig.is("FIC-206", "pv_reason", "stale"));
  rig.feeder.start();
  CHECK(rig.is("FIC-206", "pv", 5.5));
}

TEST_CASE("loopwarden-feed --browse lists the metrics of edge nodes, and requests their births",
          "[feed]") {
  tests::TemporaryFolder folder;
  const MqttBroker broker;
  ForeignProcess edge("sparkplug_edge.py", {std::to_string(broker.port()), "plant", "e1", "dev"});
  edge.command("connect");
  const auto browse = [&](const std::string& more) {
    tests::write_file(folder / "feed.yaml", "broker: {url: 'mqtt://127.0.0.1:" +
                                                std::to_string(broker.port()) + "'}\n" + more);
    return tests::run(LOOPWARDEN_BIN_DIR "/loopwarden-feed --browse plant --seconds 2 --config " +
                      (folder / "feed.yaml").string() + " 2>&1");
  };
  edge.command("set PV 2");  // is sent after the births
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  CHECK(browse("").exit_code == 74);  // the births are over, and no data arrives
  // The first message received makes it request births.
  std::thread voice([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    edge.command("set PV 3");
  });
  const auto found = browse("ask_rebirth: true\n");
  voice.join();
  INFO(found.text);
  CHECK(found.exit_code == 0);
  CHECK(found.text.find("e1/dev/PV,plant/e1/dev/PV,Float,") != std::string::npos);
  CHECK(found.text.find("Node Control") == std::string::npos);
}

TEST_CASE("loopwarden-feed by TLS, with the test's own certificate", "[feed]") {
  const tests::TemporaryFolder folder;
  const tests::Certificates certificates;
  const MqttBroker broker(certificates.broker_lines());
  const std::string url = "mqtts://127.0.0.1:" + std::to_string(broker.port());
  const auto config = [&](const std::string& authority) {
    return "broker: {url: '" + url +
           "', reconnect_min: 0.1, ca_file: " + certificates.file(authority) +
           ", certificate_file: " + certificates.file("client.crt") +
           ", key: {file: " + certificates.file("client.key") +
           "}}\nruntime_directory: " + folder.path().string() + "\ntopics: [{name: a, topic: b}]\n";
  };
  const auto says = [&](const tests::Program& feeder, const std::string& text) {
    return eventually([&] { return feeder.log().find(text) != std::string::npos; });
  };
  const std::string file = (folder / "feed.yaml").string();
  const std::vector<std::string> words{LOOPWARDEN_BIN_DIR "/loopwarden-feed", "--config", file};
  tests::write_file(file, config("ca.crt"));
  tests::Program feeder(words, folder / "log");
  feeder.start();
  CHECK(says(feeder, "broker: connected"));
  CHECK(feeder.end(SIGTERM) == 0);
  tests::write_file(file, config("other.crt"));
  tests::Program stranger(words, folder / "other log");
  stranger.start();
  CHECK(says(stranger, "broker: "));
  CHECK(stranger.end(SIGTERM) == 0);
  CHECK(stranger.log().find("broker: connected") == std::string::npos);
}

TEST_CASE(
    "loopwarden-feed --check reports errors; a bad configuration gives 78, a bad command line 64",
    "[feed]") {
  const tests::TemporaryFolder folder;
  const std::string program = LOOPWARDEN_BIN_DIR "/loopwarden-feed";
  const std::string file = (folder / "feed.yaml").string();
  tests::write_file(file, "broker: {url: 'mqtt://b'}\ntopics: [{name: a, topic: b}]\ntopic: 1\n");
  const auto bad = tests::run(program + " --check --config " + file + " 2>&1");
  CHECK(bad.exit_code == 78);
  CHECK_THAT(bad.text, Catch::Contains("feed.yaml:3:1: error: unknown key 'topic'"));
  tests::write_file(file, "broker: {url: 'mqtt://b'}\ntopics: [{name: a, topic: b}]\n");
  CHECK(tests::run(program + " --check --config " + file + " 2>&1").exit_code == 0);
  CHECK(tests::run(program + " 2>&1").exit_code == 64);
  CHECK(tests::run(program + " --config /none 2>&1").exit_code == 78);
}

}  // namespace feed_process_test
