// SPDX-License-Identifier: Apache-2.0
#include "config/config_reader.hpp"

#include "tests/config/config_support.hpp"

namespace config_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kLoopHead;
using test::kModbusLoop;
using test::ScratchFolder;
using test::with;

namespace {

const std::string kLinks = "links:\n  skid: {transport: tcp, host: 127.0.0.1}\n";

std::string said_of(const ScratchFolder& folder) {
  return folder.relative(test::said(read_configuration(folder.path())));
}

std::string second_loop() {
  return with(with(kModbusLoop, "FIC-101", "FIC-102"), "address: 100", "address: 101");
}

}  // namespace

TEST_CASE("A configuration is read in the order of its files", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  folder.write("loops.d/b.yaml", kModbusLoop);
  folder.write("loops.d/a.yaml", second_loop());
  folder.write("loops.d/.hidden.yaml", "not read");
  folder.write("loops.d/notes.txt", "not read");
  const auto configuration = read_configuration(folder.path());
  INFO(to_text(configuration.diagnostics));
  REQUIRE(configuration);
  CHECK(configuration.diagnostics.empty());
  REQUIRE(configuration->loops.size() == 2);
  CHECK(configuration->loops[0].name == "FIC-102");
  CHECK(configuration->loops[1].name == "FIC-101");
  CHECK(configuration->loops[0].file == (folder.path() / "loops.d/a.yaml").string());
  CHECK(std::get<hal::modbus::LoopModbusSettings>(configuration->loops[0].io).command.reg.address ==
        101);
}

TEST_CASE("The text of a configuration is that of its files in their order",
          "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  folder.write("loops.d/b.yaml", kModbusLoop);
  folder.write("loops.d/a.yaml", second_loop());
  const auto configuration = read_configuration(folder.path());
  REQUIRE(configuration);
  CHECK(configuration->text == kLinks + second_loop() + kModbusLoop);
}

TEST_CASE("The daemon's own file may be absent", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("m.yaml", test::kModel);
  folder.write("loops.d/a.yaml", kLoopHead + "io: {backend: simulated, model: ../m.yaml}\n");
  const auto configuration = read_configuration(folder.path());
  INFO(to_text(configuration.diagnostics));
  REQUIRE(configuration);
  CHECK(configuration->daemon.accelerate == 1.0);
  CHECK(configuration->daemon.state_directory == "/var/lib/loopwardend");
}

TEST_CASE("A configuration without loops is invalid", "[config][directory]") {
  const ScratchFolder folder;
  CHECK(said_of(folder) == "loops.d: error: can't be read: No such file or directory\n");
  folder.write("loops.d/a.yml", kModbusLoop);
  CHECK(said_of(folder) ==
        "loops.d: warning: a.yml is skipped: loop files end in .yaml\n"
        "loops.d: error: contains no loop file (*.yaml)\n");
}

TEST_CASE("Errors of all files are reported in one pass", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "log_levle: info\n" + kLinks);
  folder.write("loops.d/a.yaml", with(kModbusLoop, "kp: 0.35", "kp: x"));
  folder.write("loops.d/b.yaml", with(second_loop(), "ki: 0.04", "ki: y"));
  CHECK(said_of(folder) ==
        "loopwardend.yaml:1:1: error: unknown key 'log_levle'; did you mean 'log_level'?\n"
        "loops.d/a.yaml:6:7: error: controller.kp: must be a number (got 'x')\n"
        "loops.d/b.yaml:7:7: error: controller.ki: must be a number (got 'y')\n");
}

TEST_CASE("A link with an error is not reported as missing as well", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "links:\n  skid: {transport: tcp, host: plc}\n");
  folder.write("loops.d/a.yaml", kModbusLoop);
  CHECK(
      said_of(folder) ==
      "loopwardend.yaml:2:32: error: links.skid.host: must be a numeric address or localhost (got "
      "'plc')\n");
}

TEST_CASE("Two loops have two tags and two outputs", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  folder.write("loops.d/a.yaml", kModbusLoop);
  folder.write("loops.d/b.yaml", with(second_loop(), "FIC-102", "FIC-101"));
  CHECK(said_of(folder) ==
        "loops.d/b.yaml:1:7: error: loop: 'FIC-101' is the tag of another loop as well "
        "(loops.d/a.yaml:1:7)\n");
  folder.write("loops.d/b.yaml", with(second_loop(), "address: 101", "address: 100"));
  CHECK(said_of(folder) ==
        "loops.d/b.yaml:25:14: error: io: 127.0.0.1 port 502 unit 2 register 100 is written by "
        "another "
        "loop as well (loops.d/a.yaml:25:14)\n");
  // The second register of a two-register number.
  folder.write("loops.d/b.yaml", with(second_loop(), "address: 101, type: u16, scale: 0.001",
                                      "address: 99, type: f32"));
  CHECK(said_of(folder).find("unit 2 register 100 is written by another loop") !=
        std::string::npos);
  folder.write("loops.d/b.yaml", with(second_loop(), "address: 101, type: u16, scale: 0.001",
                                      "address: 98, type: f32"));
  CHECK(said_of(folder).empty());
}

TEST_CASE("A cascade names a master of the folder, without a circle", "[config][cascade]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  const auto with_master = [](const std::string& loop, const std::string& master) {
    return loop + "cascade: {master: " + master + "}\n";
  };
  folder.write("loops.d/a.yaml", kModbusLoop);
  folder.write("loops.d/b.yaml", with_master(second_loop(), "FIC-101"));
  CHECK(said_of(folder).empty());
  folder.write("loops.d/b.yaml", with_master(second_loop(), "FIC-110"));
  CHECK_THAT(said_of(folder), Catch::Contains("cascade.master: no loop file has the tag 'FIC-110'; "
                                              "did you mean 'FIC-101'?"));
  folder.write("loops.d/b.yaml", with_master(second_loop(), "FIC-102"));
  CHECK_THAT(said_of(folder), Catch::Contains("cascade.master: must be another loop"));
  folder.write("loops.d/a.yaml", with_master(kModbusLoop, "FIC-102"));
  folder.write("loops.d/b.yaml", with_master(second_loop(), "FIC-101"));
  CHECK_THAT(said_of(folder),
             Catch::Contains("the cascade is a circle: FIC-101 < FIC-102 < FIC-101"));
  folder.write("loops.d/a.yaml", kModbusLoop);
  folder.write("loops.d/b.yaml", second_loop() + "cascade: {}\n");
  CHECK_THAT(said_of(folder), Catch::Contains("master"));
}

TEST_CASE("An area is a path", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  folder.write("loops.d/a.yaml", kModbusLoop + "area: Unit 2/Reactor\n");
  CHECK(said_of(folder).empty());
  for (const char* area : {"/Unit 2", "Unit 2/", "Unit 2//Reactor"}) {
    folder.write("loops.d/a.yaml", kModbusLoop + "area: " + area + "\n");
    CHECK_THAT(said_of(folder), Catch::Contains("area: must be names separated by single slashes"));
  }
}

TEST_CASE("Two loops share no analog output", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loops.d/a.yaml", test::kAnalogLoop);
  folder.write("loops.d/b.yaml", with(test::kAnalogLoop, "FIC-101", "FIC-102"));
  CHECK(said_of(folder) ==
        "loops.d/b.yaml:20:5: error: io: dac current1 is written by another loop as well "
        "(loops.d/a.yaml:20:5)\n");
  folder.write("loops.d/b.yaml",
               with(with(test::kAnalogLoop, "FIC-101", "FIC-102"), "current1", "current2"));
  CHECK(said_of(folder).empty());
}

TEST_CASE("Hardware runs in real time", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "accelerate: 10\n" + kLinks);
  folder.write("loops.d/a.yaml", kModbusLoop);
  CHECK(said_of(folder) ==
        "loopwardend.yaml:1:13: error: accelerate: must be 1: FIC-101 works on hardware "
        "(loops.d/a.yaml:25:14) (got 10)\n");
}

TEST_CASE("A line that can't carry its loops is refused with the numbers", "[config][directory]") {
  const ScratchFolder folder;
  folder.write(
      "loopwardend.yaml",
      "links:\n  skid: {transport: rtu, device: /dev/ttyS0, baud: 9600, response_timeout: 0.1}\n");
  folder.write("loops.d/a.yaml", kModbusLoop);
  folder.write("loops.d/b.yaml", second_loop());
  CHECK(said_of(folder) ==
        "loopwardend.yaml:2:9: error: links.skid: at 9600 baud the line would be busy 135 % of the "
        "time, at most 70 % is sound: FIC-101 67 ms of 100 ms, FIC-102 67 ms of 100 ms. Raise baud "
        "or "
        "poll_period, or use another line\n");
  folder.write(
      "loopwardend.yaml",
      "links:\n  skid: {transport: rtu, device: /dev/ttyS0, baud: 115200, response_timeout: "
      "0.1}\n");
  CHECK(said_of(folder).empty());
}

TEST_CASE("One loop file by itself finds the links of its configuration", "[config][directory]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", kLinks);
  folder.write("loops.d/a.yaml", kModbusLoop);
  CHECK(read_loop_file(folder.path() / "loops.d/a.yaml"));
  folder.write("loopwardend.yaml", "links: {}\n");
  CHECK(folder.relative(test::said(read_loop_file(folder.path() / "loops.d/a.yaml"))) ==
        "loops.d/a.yaml:19:11: error: io.transmitter.link: no link 'skid' in loopwardend.yaml\n"
        "loops.d/a.yaml:23:11: error: io.positioner.link: no link 'skid' in loopwardend.yaml\n");
}

}  // namespace config_reader_test
