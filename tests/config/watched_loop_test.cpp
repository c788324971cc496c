// SPDX-License-Identifier: Apache-2.0
// Loops that another controller runs: `control: elsewhere`.
#include <variant>

#include "config/bus_budget.hpp"
#include "config/loop_reader.hpp"
#include "hal/modbus/line_time.hpp"
#include "tests/config/config_support.hpp"

namespace watched_loop_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::said_of_loop;
using test::with;

namespace {

// Its io section begins at line 6.
const std::string kHead = R"(loop: FIC-205
control: elsewhere
sample_time: 1
process_variable: {unit: m3/h, range: [0, 40], max_age: 5}
output: {unit: "%", range: [0, 100]}
)";

const std::string kModbus = kHead + R"(io:
  backend: modbus
  pv: {link: skid, unit: 1, register: {table: input, address: 0, type: f32}}
  co: {link: skid, unit: 2, register: {table: holding, address: 10, type: u16, scale: 0.01}}
)";

const std::string kFeed = kHead + R"(io:
  backend: feed
  pv: {feed: "opcua:FIC205.PV"}
  co: {feed: "opcua:ns=2;s=FIC205.OP"}
)";

LoopConfig read(const std::string& text) {
  auto loop = read_loop_text("loop.yaml", text, test::daemon());
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  return std::move(*loop);
}

}  // namespace

TEST_CASE("A slave in cascade is in its normal mode", "[config][watch][cascade]") {
  const auto automatic = [](const std::string& more, const std::string& manual) {
    const LoopConfig loop =
        read(kFeed + "  mode: {feed: \"opcua:M\", automatic: [AUTO], manual: [" + manual + "]}\n" +
             more);
    return std::get<hal::feed::FeedSettings>(loop.io).mode_values.automatic;
  };
  const double cas = hal::number_of_word("CAS");
  CHECK_FALSE(hal::holds(automatic("", "MAN"), cas));
  CHECK(hal::holds(automatic("cascade: {master: TIC-204}\n", "MAN"), cas));
  CHECK_FALSE(
      hal::holds(automatic("cascade: {master: TIC-204}\n", "CAS"), cas));  // the site's word
}

TEST_CASE("A loop that another controller runs is read over Modbus", "[config][watch]") {
  const LoopConfig loop =
      read(with(kModbus, "  co:",
                R"(  sp: {link: line, unit: 3, register: {table: holding, address: 4, type: i16}}
  stem: {link: skid, unit: 2, register: {table: input, address: 2, type: u16, raw: [0, 1000], )"
                R"(eu: [0, 100]}}
  mode: {link: skid, unit: 2, register: {table: coil, address: 7}, automatic: [1], manual: [0]}
  co:)"));
  CHECK(is_watched(loop.io));
  CHECK(knows_set_point(loop.io));
  CHECK(loop.co_unit == "%");
  CHECK(loop.controller.pid.output_high == 100.0);
  CHECK(loop.pv.max_age_s == 5.0);
  const auto& io = std::get<hal::modbus::ModbusSourceSettings>(loop.io);
  CHECK(io.process_variable.link.name == "skid");
  CHECK(io.process_variable.point.reg.table == hal::modbus::Table::input_register);
  CHECK(io.output.point.unit == 2);
  CHECK(io.output.point.reg.scale == 0.01);
  CHECK(io.set_point->link.name == "line");
  CHECK(io.stem->point.reg.scale == 0.1);
  CHECK(io.mode->point.reg.table == hal::modbus::Table::coil);
  CHECK(io.mode->point.reg.address == 7);
  CHECK(io.mode_values == hal::ModeValues{{1.0}, {0.0}});
  CHECK(io.poll_period_ns == 1'000'000'000);
  for (const auto* value : {&io.process_variable, &io.output, &*io.set_point}) {
    CHECK(value->point.max_age_ns == 5'000'000'000);
  }
}

TEST_CASE("A loop that another controller runs is fed", "[config][watch]") {
  const LoopConfig loop = read(kFeed + "  mode: {feed: \"opcua:M\", automatic: [1, 3]}\n");
  const auto& io = std::get<hal::feed::FeedSettings>(loop.io);
  CHECK(io.process_variable == hal::feed::FeedPoint{{"opcua", "FIC205.PV"}});
  CHECK(io.output == hal::feed::FeedPoint{{"opcua", "ns=2;s=FIC205.OP"}});
  CHECK(io.mode_values == hal::ModeValues{{1.0, 3.0}, {}});
  CHECK_FALSE(knows_set_point(loop.io));
}

TEST_CASE("Fed values are scaled, and a mode may be a word", "[config][watch]") {
  const LoopConfig loop =
      read(with(kFeed, "\"opcua:FIC205.PV\"", "\"opcua:FIC205.PV\", scale: 0.01, offset: -5") +
           "  mode: {feed: \"opcua:M\", automatic: [AUTO, CAS, 3], manual: [MAN]}\n");
  const auto& io = std::get<hal::feed::FeedSettings>(loop.io);
  CHECK(io.process_variable == hal::feed::FeedPoint{{"opcua", "FIC205.PV"}, 0.01, -5.0});
  CHECK(hal::holds(io.mode_values.automatic, hal::number_of_word("CAS")));
  CHECK(hal::holds(io.mode_values.automatic, 3.0));
  CHECK(hal::holds(io.mode_values.manual, hal::number_of_word("MAN")));
  CHECK_FALSE(hal::holds(io.mode_values.automatic, hal::number_of_word("MAN")));
  CHECK(said_of_loop(with(kFeed, "\"opcua:FIC205.PV\"", "\"opcua:FIC205.PV\", scale: 0")) ==
        "loop.yaml:8:40: error: io.pv.scale: must not be 0\n");
  CHECK(said_of_loop(kFeed + "  mode: {feed: \"opcua:M\", automatic: [AUTO], manual: [AUTO]}\n") ==
        "loop.yaml:10:54: error: io.mode.manual: AUTO is in automatic (at 10:38) as well\n");
  CHECK(said_of_loop(kModbus + "  mode: {link: skid, unit: 1, register: {table: input, address: 4, "
                               "type: u16}, automatic: [AUTO]}\n") ==
        "loop.yaml:10:91: error: io.mode.automatic: must be whole numbers (got 'AUTO')\n");
}

TEST_CASE("The other controller's law is read", "[config][watch]") {
  const LoopConfig loop =
      read(with(kFeed, "io:", "controller: {action: direct, kc: 0.8, ti: 12}\nio:"));
  CHECK(loop.controller.pid.action == control::Action::direct);
  CHECK(loop.controller.pid.gains.kp == Approx(0.8 * 100.0 / 40.0));
}

TEST_CASE("A key that would act on a watched loop is refused, with the reason", "[config][watch]") {
  const std::string why =
      ": is refused: Loopwarden never writes to this loop, because another controller runs it "
      "(control: elsewhere, at 2:10)\n";
  const auto said_of = [](const std::string& keys) {
    return said_of_loop(with(kFeed, "io:", keys + "\nio:"));
  };
  CHECK(said_of("start: {mode: automatic, set_point: 5}") == "loop.yaml:6:8: error: start" + why);
  CHECK(said_of("safe_actions: {stop: 1}") == "loop.yaml:6:15: error: safe_actions" + why);
  const std::string law = "controller: {action: reverse, kp: 1, ki: 0, ";
  CHECK(said_of(law + "jacket: {form: bounded, ks: 1}}") ==
        "loop.yaml:6:53: error: controller.jacket" + why);
  CHECK(said_of(law + "compensator: {kind: knocker}}") ==
        "loop.yaml:6:58: error: controller.compensator" + why);
  CHECK(said_of(law + "output: {unit: V, range: [0, 10]}}") ==
        "loop.yaml:6:53: error: controller.output" + why);
  CHECK(said_of("monitor: {corrective_action: {enabled: true}}") ==
        "loop.yaml:6:30: error: monitor.corrective_action" + why);
  CHECK(said_of_loop(with(kFeed, "[0, 100]}", "[0, 100], limits: [5, 95]}")) ==
        "loop.yaml:5:46: error: output.limits" + why);
}

TEST_CASE("A feeder can't supply the PV of a loop that is controlled here", "[config][watch]") {
  CHECK(said_of_loop(test::kLoopHead + "io: {backend: feed, pv: {feed: \"opcua:X\"}}\n") ==
        "loop.yaml:16:15: error: io.backend: feed needs `control: elsewhere`, because values of a "
        "feeder must not move a valve\n");
}

TEST_CASE("A watched loop's backends are those that only read", "[config][watch]") {
  CHECK(said_of_loop(kHead + "io: {backend: simulated}\n") ==
        "loop.yaml:6:15: error: io.backend: must be modbus or feed (got 'simulated')\n");
}

TEST_CASE("The name of a fed value is a feeder's", "[config][watch]") {
  CHECK(said_of_loop(with(kFeed, "opcua:FIC205.PV", "FIC205.PV")) ==
        "loop.yaml:8:14: error: io.pv.feed: must be FEEDER:NAME, such as opcua:FIC205.PV (got "
        "'FIC205.PV')\n");
  CHECK(said_of_loop(with(kFeed, "opcua:FIC205.PV", "opcau:FIC205.PV")) ==
        "loop.yaml:8:14: error: io.pv.feed: no feeder 'opcau' in loopwardend.yaml; did you mean "
        "'opcua'?\n");
}

TEST_CASE("A mode's numbers mean one thing each", "[config][watch]") {
  CHECK(said_of_loop(kFeed + "  mode: {feed: \"opcua:M\", automatic: [1, 3], manual: [3]}\n") ==
        "loop.yaml:10:54: error: io.mode.manual: 3 is in automatic (at 10:38) as well\n");
  CHECK(said_of_loop(kFeed + "  mode: {feed: \"opcua:M\", automatic: [1.5]}\n") ==
        "loop.yaml:10:38: error: io.mode.automatic: must be whole numbers or words of at most 64 "
        "bytes (got '1.5')\n");
  CHECK(said_of_loop(kFeed + "  mode: {feed: \"opcua:M\"}\n") ==
        "loop.yaml:10:9: error: io.mode: missing key 'automatic' (list of numbers or words: "
        "windows are evaluated in these modes only)\n");
}

TEST_CASE("Watched loops are listed after those controlled here, whatever their files' names",
          "[config][watch]") {
  const test::ScratchFolder folder;
  const auto tagged = [](const std::string& text, const std::string& from, const std::string& tag) {
    return with(text, from, "loop: " + tag + "\n");
  };
  folder.write(
      "loopwardend.yaml",
      "links:\n  skid: {transport: tcp, host: 127.0.0.1}\nfeeders: {opcua: {user: root}}\n");
  folder.write("loops.d/b.yaml", tagged(test::kModbusLoop, "loop: FIC-101\n", "FIC-2"));
  folder.write("loops.d/a.yaml", tagged(kFeed, "loop: FIC-205\n", "FIC-9"));
  folder.write("loops.d/c.yaml", tagged(kModbus, "loop: FIC-205\n", "FIC-8"));
  folder.write("loops.d/d.yaml", with(tagged(test::kModbusLoop, "loop: FIC-101\n", "FIC-1"),
                                      "address: 100,", "address: 200,"));
  const auto all = read_configuration(folder.path());
  INFO(to_text(all.diagnostics));
  REQUIRE(all);
  std::string order;
  for (const LoopConfig& loop : all->loops) order += loop.name + " ";
  CHECK(order == "FIC-2 FIC-1 FIC-9 FIC-8 ");
}

TEST_CASE("Feeders are users, who may share one", "[config][watch]") {
  const auto daemon = read_daemon_text("d.yaml", "feeders: {opcua: {user: root}}\n");
  REQUIRE(daemon);
  CHECK(daemon->feeders.at("opcua") == FeederUser{"root", 0});
  CHECK(test::said_of_daemon("feeders:\n  a: {user: root}\n  b: {user: root}\n").empty());
  CHECK(test::said_of_daemon("feeders: {a: {user: nobody-of-this-name}}\n") ==
        "d.yaml:1:21: warning: feeders.a.user: there is no user 'nobody-of-this-name' on this "
        "host, so this feeder can't write values\n");
}

TEST_CASE("A watched loop on a serial line counts in its time", "[config][watch]") {
  const LoopConfig loop =
      read(with(with(kModbus, "link: skid", "link: line"), "unit: 1,", "unit: 4,"));
  hal::modbus::LinkSettings line = test::daemon().links.at("line");
  const BusLoad load = bus_load({loop}, line);
  CHECK(load.share == Approx(hal::modbus::read_s(line, 2)));  // PV each second; CO is elsewhere
  CHECK(load.details.find("(1 request)") != std::string::npos);
}

TEST_CASE("A watched loop may have any mode as normal, and its source has an alarm",
          "[config][watch][alarms]") {
  using alarm::NormalMode;
  CHECK(read(kModbus).alarms.process.normal_mode == NormalMode::any);
  const std::string own = kModbus + "alarms:\n  source_lost: {off_delay: 5}\n";
  CHECK(read(own).alarms.process.normal_mode == NormalMode::any);
  CHECK(read(own).alarms.process.at(alarm::AlarmKind::source_lost).off_delay_s == 5.0);
  CHECK_THAT(said_of_loop(own), !Catch::Contains("no such alarm"));
  CHECK(read(own + "  normal_mode: automatic\n").alarms.process.normal_mode ==
        NormalMode::automatic);
  CHECK_THAT(said_of_loop(kModbus + "alarms: {enable_open: {priority: low}}\n"),
             Catch::Contains("loop.yaml:10:23: warning: alarms.enable_open: the loop has no such "
                             "alarm: io has no enable contact"));
}

}  // namespace watched_loop_test
