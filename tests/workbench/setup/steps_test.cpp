// SPDX-License-Identifier: Apache-2.0
// The steps that don't move a valve, with a scripted person and fake devices.
#include <catch2/catch.hpp>

#include <algorithm>

#include "config/config_reader.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/workbench/setup/scripted_setup.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/loop_text.hpp"
#include "workbench/setup/planned_files.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup::steps_test {
namespace {

using tests::ScriptedSetup;

const std::map<std::string, std::string> kControlled{{"control", "here"},
                                                     {"description", "Water: \"cold\" #1"},
                                                     {"pv.unit", "m3/h"},
                                                     {"pv.range", "0 25"},
                                                     {"co.unit", "%"},
                                                     {"co.range", "0 100"},
                                                     {"sample_time", "0.2"},
                                                     {"link.transport", "tcp"},
                                                     {"link.hosts", "127.0.0.1"},
                                                     {"link.host", "127.0.0.1"},
                                                     {"link.port", "1502"},
                                                     {"scan.units", "none"},
                                                     {"pv.register", "1 input 12 u16"},
                                                     {"pv.scale", "0 10000 0 25"},
                                                     {"co.register", "2 holding 2 u16"},
                                                     {"co.scale", "10000 0 100 0"},
                                                     {"stem.register", "2 input 20 f32 cdab"},
                                                     {"stem.scale", "none"},
                                                     {"comm_loss", "register"},
                                                     {"comm_loss.timeout", "2"},
                                                     {"comm_loss.register", "2 holding 10 u16"},
                                                     {"comm_loss.scale", "0 10 0 1"},
                                                     {"pv.follows", "falls"},
                                                     {"kc", "0.3"},
                                                     {"ti", "8"},
                                                     {"sp.limits", "2 22"},
                                                     {"co.limits", "5 95"},
                                                     {"co.rate", "10"},
                                                     {"stop.end", "hold"},
                                                     {"stop.bad_pv", "5"},
                                                     {"stop.output_lost", "hold"},
                                                     {"write", "yes"}};

void answer_all(ScriptedSetup& s, const std::map<std::string, std::string>& answers) {
  for (const auto& [id, answer] : answers) s.state.answer(id, answer);
}

// The loop's registers have plausible values.
void connect_devices(ScriptedSetup& s) {
  s.devices.units = {1, 2};
  s.devices.values = {
      {{"input", 12}, {4000.0}}, {{"holding", 2}, {5000.0}}, {{"input", 20}, {50.0}}};
}

// A register that keeps each value while it is read: once to show it and for a second after it.
std::deque<double> held(const std::vector<double>& values) {
  std::deque<double> series;
  for (const double value : values) series.insert(series.end(), 12, value);
  return series;
}

config::Configuration as_read(const ScriptedSetup& s) {
  auto read = config::read_configuration(s.folder.path());
  INFO(config::to_text(read.diagnostics));
  REQUIRE(read);
  return std::move(*read);
}

}  // namespace

TEST_CASE("the files contain the answers", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  INFO(s.person.said);
  REQUIRE(write_files(s.all) == Outcome::done);
  const config::Configuration all = as_read(s);
  const config::LoopConfig& loop = all.loops.at(0);
  CHECK(loop.name == "FIC-101");
  CHECK(loop.description == "Water: \"cold\" #1");
  CHECK(loop.controller.pid.action == control::Action::direct);
  CHECK(loop.controller.output.low == 5.0);
  CHECK(loop.safety.on_stop.kind == control::OutputAction::Kind::hold);
  CHECK(loop.safety.on_bad_pv.kind == control::OutputAction::Kind::value);
  CHECK(loop.safety.on_bad_pv.value == 5.0);
  CHECK(loop.pv.frozen_after_s >= 60.0);
  CHECK(loop.pv.frozen_acts);
  CHECK(loop.start.mode == control::Mode::manual);
  const auto& io = std::get<hal::modbus::LoopModbusSettings>(loop.io);
  CHECK(io.positioner_link.port == 1502);
  CHECK(io.process_variable.unit == 1);
  CHECK(io.process_variable.reg.scale == Approx(0.0025));
  CHECK(io.command.unit == 2);
  CHECK(io.command.reg.scale == Approx(0.01));
  CHECK(io.read_back.value().reg.order == hal::modbus::ByteOrder::cdab);
  CHECK(io.comm_loss.timeout_s == 2.0);
  // The register has tenths of a second.
  CHECK(io.comm_loss.watchdog.value().point.reg.scale == Approx(0.1));
  CHECK(io.comm_loss.watchdog.value().value == 2.0);
}

TEST_CASE("a watched loop has no output, and an existing link is used", "[setup]") {
  ScriptedSetup s;
  const std::string daemon =
      "# ours\nlinks:\n    plc: {transport: tcp, host: 127.0.0.1, port: 1502}\n";
  tests::write_file(s.folder / "loopwardend.yaml", daemon);
  answer_all(s, kControlled);
  answer_all(s, {{"control", "elsewhere"},
                 {"source", "modbus"},
                 {"co.register", "1 input 14 u16"},
                 {"sp.register", "1 holding 3 u16"},
                 {"sp.scale", "0 10000 0 25"},
                 {"mode.register", "1 input 16 u16"},
                 {"mode.automatic", "1, 3"}});
  INFO(s.person.said);
  REQUIRE(write_files(s.all) == Outcome::done);
  const config::Configuration all = as_read(s);
  const auto& io = std::get<hal::modbus::ModbusSourceSettings>(all.loops.at(0).io);
  CHECK(io.output.point.reg.address == 14);
  CHECK(io.set_point.value().point.reg.scale == Approx(0.0025));
  CHECK(io.mode_values.automatic == std::vector<double>{1.0, 3.0});
  CHECK(tests::read_file(s.folder / "loopwardend.yaml") == daemon);
}

TEST_CASE("printed commands have the folder and the socket of the setup", "[setup]") {
  ScriptedSetup s;
  s.all.folder = "my config";
  s.all.socket = "/tmp/run/control.sock";
  CHECK(s.all.command("record") ==
        "`loopwarden setup FIC-101 --config 'my config' --socket /tmp/run/control.sock --again "
        "record`");
  CHECK(s.all.remedies().reload == "Run `loopwarden reload --socket /tmp/run/control.sock`.");
  CHECK_THAT(s.all.remedies().restart, Catch::Contains("(`loopwardend --config 'my config'`)"));
  CHECK_THROWS(start_loop(s.all));  // the person ends the input
  CHECK(s.person.told("Start the daemon (`loopwardend --config 'my config'`)."));
  s.all.folder = kDefaultFolder;
  s.all.socket = DaemonClient::kDefaultSocket;
  CHECK(s.all.command() == "`loopwarden setup FIC-101`");
  CHECK(s.all.remedies().restart == protocol::Remedies{}.restart);
}

TEST_CASE("files that the reader refuses are not written", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  s.state.answer("comm_loss.timeout", "0.5");  // shorter than two lost replies
  CHECK_THROWS_AS(write_files(s.all), TestAborted);
  CHECK(s.person.told("timeout"));
  CHECK_FALSE(std::filesystem::exists(s.all.loop_file()));
  CHECK_FALSE(std::filesystem::exists(s.folder / "loopwardend.yaml"));
}

TEST_CASE("lines are added to a live file only if the daemon would accept it", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  s.state.answer("masters", "yes");
  const std::filesystem::path file = s.folder / "loopwardend.yaml";
  // The loop's link exists already. The new lines fit, or they don't, because a mapping in braces
  // has an end.
  const bool fit = GENERATE(true, false);
  const std::string link = "links: {plc: {transport: tcp, host: 127.0.0.1, port: 1502}}";
  tests::write_file(file, fit ? link : "{" + link + "}");
  REQUIRE(write_files(s.all) == Outcome::done);
  const std::string before = tests::read_file(file);
  const auto written = std::filesystem::last_write_time(file);
  if (fit) {
    CHECK(connect_masters(s.all) == Outcome::done);
    CHECK(tests::read_file(file) == before + "\nmodbus_server: {}  # this host alone\n");
    CHECK(as_read(s).daemon.modbus_server);
  } else {
    CHECK_THROWS_WITH(connect_masters(s.all), Catch::Contains("was not changed"));
    CHECK(tests::read_file(file) == before);
    CHECK(std::filesystem::last_write_time(file) == written);
  }
}

TEST_CASE("files next to the configuration are also found from drafts", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  // The file is of another loop, by a path relative to the loop's folder.
  tests::write_file(s.folder / "plant.yaml",
                    tests::read_file(LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml"));
  tests::write_file(s.folder / "loops.d/FIC-1.yaml", tests::loop_file("FIC-1", "../plant.yaml"));
  CHECK(write_files(s.all) == Outcome::done);
  CHECK(as_read(s).loops.size() == 2);
}

TEST_CASE("a link is added after the existing ones, and comments stay", "[setup]") {
  CHECK(with_link("", "a", "{x: 1}") == "links:\n  a: {x: 1}\n");
  CHECK(with_link("page: {alarms: true}", "a", "{x: 1}") ==
        "page: {alarms: true}\nlinks:\n  a: {x: 1}\n");
  CHECK(with_link("links:  # ours\n# more\n    b: {}\npage: {}\n", "a", "{x: 1}") ==
        "links:  # ours\n    a: {x: 1}\n# more\n    b: {}\npage: {}\n");
  CHECK_FALSE(with_link("links: {b: {}}\n", "a", "{x: 1}"));
}

TEST_CASE("a scan covers the typed range, and only reads", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  answer_all(s, {{"link.hosts", "10.0.0.1 10.0.0.2"}, {"scan.units", "1,4"}});
  connect_devices(s);
  s.devices.values[{"input", 0}] = {7.0};
  INFO(s.person.said);
  REQUIRE(find_devices(s.all) == Outcome::done);
  CHECK(s.person.told(
      "10.0.0.1 unit 1: input register 0: raw 0007 = 7, holding register 0: illegal"));
  CHECK(s.person.told("10.0.0.2 unit 4: no reply"));
  std::vector<std::string> hosts;
  for (const protocol::Probe& asked : s.devices.asked) {
    CHECK((asked.unit == 1 || asked.unit == 2 || asked.unit == 4));
    CHECK((asked.host == "10.0.0.1" || asked.host == "10.0.0.2" || asked.host == "127.0.0.1"));
  }
  // On each address two requests to a unit that answers and one to a dead unit, then three
  // registers of the loop.
  CHECK(s.devices.asked.size() == 2 * 3 + 3);
}

TEST_CASE("a line with a running loop is not scanned, and numbers are typed", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  answer_all(s, {{"scan.units", "1-30"}, {"pv.scale", "live"}});
  s.devices.refusal = "FIC-7 runs on it";
  s.person.lines = {"live", "0 27648 0 25"};
  REQUIRE(find_devices(s.all) == Outcome::done);
  CHECK(s.person.told("no scan: FIC-7 runs on it"));
  CHECK(s.state.answers().at("pv.scale") == "0 27648 0 25");
}

TEST_CASE("a loop of an OPC UA server is made by discover", "[setup]") {
  ScriptedSetup s;
  answer_all(s,
             {{"control", "elsewhere"}, {"source", "opcua"}, {"opcua.url", "opc.tcp://plc:4840"}});
  const std::string folder = s.folder.path().string();
  const std::vector<std::string> discover{"discover",
                                          "--opcua",
                                          "opc.tcp://plc:4840",
                                          "--out",
                                          folder + "/loops.d",
                                          "--nodes",
                                          folder + "/setup/FIC-101-nodes.yaml"};
  // Its tag is not among the found ones.
  CHECK_THROWS_AS(find_devices(s.all), TestAborted);
  CHECK(s.ran == std::vector<std::vector<std::string>>{discover});
  s.all.run = [&](const std::vector<std::string>& words, const std::filesystem::path&) {
    CHECK(words == discover);
    tests::write_file(s.all.loop_file(), "control: elsewhere\n");
    return 0;
  };
  CHECK(find_devices(s.all) == Outcome::done);
  CHECK(s.person.told("FIC-101-nodes.yaml"));
  CHECK(s.devices.asked.empty());
}

TEST_CASE("a register is scaled by the value on its display", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  s.state.answer("pv.scale", "live");
  connect_devices(s);
  auto& pv = s.devices.values[{"input", 12}];
  SECTION("two values") {
    pv = held({4300.0, 6000.0, 4000.0});
    s.person.lines = {"43 %", "15"};
    find_devices(s.all);
    CHECK(s.state.answers().at("pv.scale") == "4300 6000 10.75 15");
    CHECK(s.person.told("raw 0FA0 = 4000 = 10 m3/h"));
  }
  SECTION("one value and zero") {
    pv = {4300.0};
    s.person.lines = {"r", "lots", "43 %", ""};
    find_devices(s.all);
    CHECK(s.state.answers().at("pv.scale") == "0 4300 0 10.75");
  }
  SECTION("the same value twice") {
    pv = held({4300.0, 4300.0, 8600.0});
    s.person.lines = {"43 %", "43 %", "86 %"};
    find_devices(s.all);
    CHECK(s.person.told("too close: raw 4300 = 10.75 m3/h and raw 4300 = 10.75 m3/h"));
    CHECK(s.state.answers().at("pv.scale") == "4300 8600 10.75 21.5");
  }
  SECTION("raw values that differ only by noise") {
    s.state.answer("pv.register", "1 input 12 f32");
    pv = {-0.0058};
    for (int i = 0; i < 100; ++i) pv.push_back(-0.0048 + 0.001 * (i % 3 - 1));
    s.person.lines = {"99 %", "12 m3/h"};
    CHECK_THROWS_AS(find_devices(s.all), Paused);
    CHECK(s.person.told("too close: raw -0.0048 = 24.75 m3/h and raw -0.0048 = 12 m3/h"));
    CHECK(s.person.told("raw values by more than 0.01"));
  }
  SECTION("a first value while the register moves") {
    pv = {4000.0};
    for (int i = 0; i < 11; ++i) pv.push_back(4000.0 + 100.0 * i);
    for (const double value : held({6000.0, 8000.0, 8000.0})) pv.push_back(value);
    s.person.lines = {"10", "15", "20"};
    find_devices(s.all);
    CHECK(s.person.told("too close"));
    CHECK(s.state.answers().at("pv.scale") == "6000 8000 15 20");
  }
  SECTION("noise and zero") {
    s.state.answer("pv.register", "1 input 12 f32");
    for (int i = 0; i < 100; ++i) pv.push_back(-0.0048 + 0.001 * (i % 3 - 1));
    s.person.lines = {"99 %", ""};
    CHECK_THROWS_AS(find_devices(s.all), Paused);
    CHECK(s.person.told("too close"));
  }
  SECTION("a range that a later value leaves") {
    pv = held({4000.0, 4100.0});
    pv.insert(pv.end(), 11, 4600.0);
    for (const double value : held({1000.0, 9000.0, 9000.0})) pv.push_back(value);
    s.person.lines = {"10", "15", "2.5", "22.5"};
    find_devices(s.all);
    CHECK(s.person.told("40 m3/h is outside of the range 0 to 25. Enter both points again"));
    CHECK(s.state.answers().at("pv.scale") == "1000 9000 2.5 22.5");
  }
  SECTION("unscaled") {
    pv = {9.0};
    s.person.lines = {""};
    find_devices(s.all);
    CHECK(s.state.answers().at("pv.scale") == "none");
  }
}

TEST_CASE("a loop with a file is commissioned without changes", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  REQUIRE(write_files(s.all) == Outcome::done);
  const std::string before = tests::read_file(s.all.loop_file());
  std::filesystem::remove(s.state.file());
  State state(s.state.file());
  state.answer("tag", "FIC-101");
  Dialogue dialogue(s.person, {}, state);
  Setup all{.dialogue = dialogue,
            .prober = s.devices,
            .run = s.all.run,
            .folder = s.folder.path(),
            .socket = s.all.socket,
            .tag = "FIC-101"};
  // Without a daemon the dialogue ends here.
  CHECK_THROWS_AS(run_steps(all), Paused);
  CHECK(state.step("file") == "done");
  CHECK(state.answers().at("control") == "here");
  CHECK(tests::read_file(all.loop_file()) == before);
}

namespace {

// The state after `setup` has written the file and `--again STEP` repeats a step.
void again(ScriptedSetup& s, const std::string& step) {
  s.state.set_step(step, "done");
  s.state.set_step("file", "done");
  s.state.set_step("stroke", "done");
  s.state.forget(step);
}

// A person's changes to the file that setup wrote.
std::string edited(const ScriptedSetup& s) {
  std::string text = tests::read_file(s.all.loop_file());
  text.replace(text.find("kc: 0.3 "), 8, "kc: 0.45 ");
  return "# ours\n" + text + "alarms: {pv_high: {limit: 20, priority: medium}}\n";
}

}  // namespace

TEST_CASE("an existing file keeps the lines that setup did not write", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  REQUIRE(write_files(s.all) == Outcome::done);
  // setup recognizes its file by the text, or by the answers of an older version
  const bool known = GENERATE(true, false);
  if (!known) s.state.set_found("written", "");
  const std::string live = edited(s);
  tests::write_file(s.all.loop_file(), live);
  again(s, "file");
  SECTION("the same answers leave the file unchanged") {
    s.person.lines.assign(9, "");
    CHECK(write_files(s.all) == Outcome::done);
    CHECK(tests::read_file(s.all.loop_file()) == live);
    CHECK(s.person.told("stays as it is"));
    CHECK(s.state.step("stroke") == "done");
  }
  SECTION("another answer changes only its lines, after a yes") {
    s.person.lines = {"rises", "", "", "", "", "", "", "", "", "", "yes"};
    CHECK(write_files(s.all) == Outcome::done);
    std::string wanted = live;
    wanted.replace(wanted.find("action: direct"), 14, "action: reverse");
    CHECK(tests::read_file(s.all.loop_file()) == wanted);
    CHECK(s.person.told("-   action: direct"));
    CHECK(s.person.told("+   action: reverse"));
    // The stroke test made with the earlier file is repeated.
    CHECK(s.state.step("stroke").empty());
  }
  SECTION("no yes, no change") {
    s.person.lines = {"rises", "", "", "", "", "", "", "", "", "no"};
    CHECK(write_files(s.all) == Outcome::left);
    CHECK(tests::read_file(s.all.loop_file()) == live);
  }
  SECTION("an answer that conflicts with a person's line") {
    s.person.lines = {"", "0.2", "", "", "", "", "", "", ""};
    const bool terminal = GENERATE(true, false);
    s.person.keys = terminal;
    if (terminal) {
      s.person.lines.insert(s.person.lines.end(), {"no"});
      CHECK(write_files(s.all) == Outcome::done);
    } else {
      CHECK_THROWS_WITH(write_files(s.all), Catch::Contains("was not changed"));
    }
    CHECK(s.person.told("-   kc: 0.45"));
    CHECK(tests::read_file(s.all.loop_file()) == live);
  }
}

TEST_CASE("a file that setup did not write is not replaced without a yes", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  const std::string live =
      tests::loop_file("FIC-101", LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml");
  tests::write_file(s.all.loop_file(), live);
  s.person.keys = GENERATE(true, false);
  CHECK_THROWS(write_files(s.all));
  CHECK(tests::read_file(s.all.loop_file()) == live);
}

TEST_CASE("a link is found by its address, with any other settings", "[setup]") {
  ScriptedSetup s;
  const std::string daemon =
      "links:\n  plc: {transport: tcp, host: localhost, port: 1502, response_timeout: 1}\n";
  tests::write_file(s.folder / "loopwardend.yaml", daemon);
  answer_all(s, kControlled);
  s.state.answer("link.host", GENERATE("127.0.0.1", "localhost", "::ffff:127.0.0.1"));
  s.state.answer("comm_loss.timeout", "10");
  INFO(s.person.said);
  REQUIRE(write_files(s.all) == Outcome::done);
  CHECK(tests::read_file(s.folder / "loopwardend.yaml") == daemon);
  const config::Configuration all = as_read(s);
  CHECK(std::get<hal::modbus::LoopModbusSettings>(all.loops.at(0).io).positioner_link.name ==
        "plc");
}

TEST_CASE("an answer that the file would refuse is refused at once", "[setup]") {
  ScriptedSetup s;
  s.dialogue.check_by([&](const std::string& id, const std::string& answer) {
    return why_refused(s.all, id, answer);
  });
  SECTION("each answer of a valid file is accepted") {
    for (const std::string& id : question_ids()) {
      const auto answer = kControlled.find(id);
      if (answer == kControlled.end()) continue;
      INFO(id);
      CHECK(why_refused(s.all, id, answer->second).empty());
      s.state.answer(id, answer->second);
    }
  }
  SECTION("each answer that conflicts with earlier ones is refused") {
    answer_all(s, kControlled);
    const std::vector<std::pair<std::string, std::string>> wrong{
        {"stop.bad_pv", "150"},           {"stop.end", "-5"},
        {"co.limits", "5 150"},           {"sp.limits", "2 40"},
        {"comm_loss.timeout", "0.5"},     {"link.port", "70000"},
        {"link.host", "plc.example"},     {"pv.scale", "0 7.6e-43 0 5"},
        {"co.register", "1 input 0 f32"}, {"comm_loss.scale", "0 1e7 0 1"}};
    for (const auto& [id, answer] : wrong) {
      INFO(id << ": " << answer);
      CHECK_FALSE(s.dialogue.why_refused(id, answer).empty());
    }
    // The later questions are asked again instead.
    CHECK(s.dialogue.why_refused("pv.range", "0 10").empty());
    s.state.answer("pv.range", "0 10");
    s.state.answer("pv.scale", "0 10000 0 10");
    s.person.lines = {"1 9"};
    CHECK(write_files(s.all) == Outcome::done);
    CHECK(s.state.answers().at("sp.limits") == "1 9");
  }
  SECTION("CO needs a holding register, and the one that was read is in the file") {
    answer_all(s, kControlled);
    connect_devices(s);
    s.state.forget_answer("co.register");
    s.devices.values[{"holding", 6}] = {5000.0};
    s.person.lines = {"1 input 0 f32", "2 holding 6 u16"};
    REQUIRE(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told("an input register can only be read. Name a holding register"));
    for (const auto& asked : s.devices.asked) CHECK((asked.table != "input" || asked.address != 0));
    REQUIRE(write_files(s.all) == Outcome::done);
    const config::Configuration all = as_read(s);
    const auto& io = std::get<hal::modbus::LoopModbusSettings>(all.loops.at(0).io);
    CHECK(io.command.unit == 2);
    CHECK(io.command.reg.address == 6);
    // An answer that an older version accepted is not written.
    std::filesystem::remove(s.all.loop_file());
    s.state.answer("co.register", "1 input 0 f32");
    CHECK_THROWS_WITH(write_files(s.all), Catch::Contains("co.register is asked again"));
    CHECK_FALSE(std::filesystem::exists(s.all.loop_file()));
    s.state.answer("control", "elsewhere");
    CHECK(s.dialogue.why_refused("co.register", "1 input 0 f32").empty());
  }
  SECTION("and the question is repeated") {
    answer_all(s, kControlled);
    s.state.forget_answer("stop.bad_pv");
    s.person.lines = {"150", "20 %"};
    CHECK(s.dialogue.ask("stop.bad_pv") == "20");
    CHECK(s.person.told("safe_actions.bad_pv"));
  }
}

TEST_CASE("a register whose value is out of range is asked for again", "[setup]") {
  ScriptedSetup s;
  answer_all(s, kControlled);
  s.state.answer("stem.register", "none");
  connect_devices(s);
  auto& wrong = s.devices.values[{"input", 12}];
  auto& right = s.devices.values[{"input", 14}];
  SECTION("by its scaled value") {
    wrong = {65000.0};
    right = {4000.0};
    s.person.lines = {"1 input 14 u16", ""};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told("162.5 m3/h is outside of the range 0 to 25"));
    CHECK(s.state.answers().at("pv.register") == "1 input 14 u16");
    CHECK(s.state.answers().at("pv.scale") == "0 10000 0 25");
  }
  SECTION("a register without a value") {
    right = {4000.0};
    const auto [where, why] = GENERATE(std::pair{"1 input 99 u16", "illegal data address"},
                                       std::pair{"7 input 14 u16", "no reply within 300 ms"});
    s.state.answer("pv.register", where);
    s.state.forget_answer("pv.scale");
    s.person.lines = {"1 input 14 u16", "0 10000 0 25"};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told(std::string(why) + ": unit, register"));
    CHECK(s.state.answers().at("pv.register") == "1 input 14 u16");
  }
  SECTION("the same register twice is accepted, also without a value") {
    s.state.answer("pv.register", "1 input 99 u16");
    s.person.lines = {"", ""};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.state.answers().at("pv.register") == "1 input 99 u16");
  }
  SECTION("the same register twice is accepted") {
    wrong = {65000.0};
    s.person.lines = {"", ""};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.state.answers().at("pv.register") == "1 input 12 u16");
  }
  SECTION("an implausible floating-point number, before it is scaled") {
    s.state.answer("pv.register", "1 input 12 f32");
    s.state.forget_answer("pv.scale");
    wrong = {8.77e-41};
    right = {5.0};
    s.person.lines = {"1 input 14 f32", "live", "5.0 m3/h", ""};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told("is no measured value"));
    CHECK(s.state.answers().at("pv.register") == "1 input 14 f32");
  }
  SECTION("a floating-point number far below the range, read across two numbers") {
    s.state.answer("pv.register", "1 input 12 f32");
    s.state.answer("pv.scale", "none");
    wrong = {4.17e-8};
    right = {11.2};
    s.person.lines = {"1 input 14 f32", "none"};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told("is no measured value"));
    CHECK(s.state.answers().at("pv.register") == "1 input 14 f32");
  }
  SECTION("a displayed value out of range is refused") {
    s.state.answer("pv.scale", "live");
    wrong = {4000.0};
    s.person.lines = {"522.3", "10 m3/h", ""};
    CHECK(find_devices(s.all) == Outcome::done);
    CHECK(s.person.told("522.3 m3/h is outside"));
    CHECK(s.state.answers().at("pv.scale") == "0 4000 0 10");
  }
}

}  // namespace loopwarden::workbench::setup::steps_test
