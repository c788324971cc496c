// SPDX-License-Identifier: Apache-2.0
// Tests the judgement of a folder: each refusal of a start is an error, and one loop's errors leave
// the others in their places.
#include "config/validation/validation.hpp"

#include <algorithm>
#include <filesystem>

#include "tests/config/config_support.hpp"

namespace validation_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kLoopHead;
using test::kModbusLoop;
using test::ScratchFolder;
using test::with;

namespace {

const std::string kTwin =
    "sample_time: 0.1\ncontroller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
    "process: {gain: 1.0, time_constant: 1.5, dead_time: 0.6}\ntransmitter: {range: [0, 10]}\n";

std::string simulated(const std::string& tag, const std::string& more = "") {
  return with(kLoopHead, "FIC-101", tag) + "io: {backend: simulated, model: ../m.yaml}\n" + more;
}

std::string on_link(const std::string& tag, const std::string& link, int unit, int address) {
  return with(with(with(kModbusLoop, "FIC-101", tag), "link: skid\n    unit: 1",
                   "link: " + link + "\n    unit: " + std::to_string(unit)),
              "link: skid\n    unit: 2\n    command: {address: 100",
              "link: " + link + "\n    unit: " + std::to_string(unit) +
                  "\n    command: {address: " + std::to_string(address));
}

std::string said_of(const ScratchFolder& folder) {
  return folder.relative(to_text(validate(folder.path()).reading.diagnostics));
}

// Returns the tags in the order of the loops; those out of service with a minus.
std::vector<std::string> tags_of(const Validated& validated) {
  std::vector<std::string> tags;
  for (const LoopConfig& loop : validated.reading.configuration.loops) {
    tags.push_back((out_of_service(loop.io) != nullptr ? "-" : "") + loop.name);
  }
  return tags;
}

using Tags = std::vector<std::string>;

struct Named {
  std::string text;
  bool contains(const std::string& part) const { return text.find(part) != std::string::npos; }
};

}  // namespace

TEST_CASE("files that a loop's file names are judged too", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("m.yaml", test::kModel);
  folder.write("loops.d/a.yaml", simulated("FIC-101", "monitor: {twin: ../twin.yaml}\n"));
  folder.write("loops.d/b.yaml", simulated("FIC-102"));
  folder.write("twin.yaml", kTwin);
  CHECK(said_of(folder).empty());
  CHECK(validate(folder.path()).reading.sound);
  struct Case {
    std::string twin, part;
  };
  for (const auto& [twin, part] :
       {Case{with(kTwin, "range: [0, 10]", "range: [0, 25]"), "transmitter.range [0, 25]"},
        Case{with(kTwin, "sample_time: 0.1", "sample_time: 0.2"), "sample_time 0.2 s"},
        Case{with(kTwin, "output: [0, 10]", "output: [0, 100]"), "controller.output [0, 100]"},
        Case{"nothing: here\n", "no twin"}, Case{"", "no twin"}}) {
    folder.write("twin.yaml", twin);
    const Validated validated = validate(folder.path());
    const Named said{folder.relative(to_text(validated.reading.diagnostics))};
    INFO(said.text);
    CHECK(said.contains("loops.d/a.yaml:17:17: error: monitor.twin: "));
    CHECK(said.contains(part));
    CHECK_FALSE(validated.reading.sound);
    CHECK(validated.reading.runnable);
    CHECK(tags_of(validated) == Tags{"-FIC-101", "FIC-102"});
    CHECK_FALSE(validate_all(folder.path()));
    CHECK_FALSE(validate_loop_file(folder.path() / "loops.d/a.yaml"));
    CHECK(validate_loop_file(folder.path() / "loops.d/b.yaml"));
  }
  std::filesystem::remove(folder / "twin.yaml");
  CHECK(tags_of(validate(folder.path())) == Tags{"-FIC-101", "FIC-102"});
  // The same for specialists.
  folder.write("loops.d/a.yaml", simulated("FIC-101", "monitor: {specialists: ../none}\n"));
  CHECK(said_of(folder).find("loops.d/a.yaml:17:24: error: monitor.specialists: ") !=
        std::string::npos);
  CHECK(tags_of(validate(folder.path())) == Tags{"-FIC-101", "FIC-102"});
}

TEST_CASE("a draft of setup is judged with the files that it names", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("m.yaml", test::kModel);
  folder.write("twin.yaml", with(kTwin, "sample_time: 0.1", "sample_time: 0.2"));
  folder.write("loops.d/a.yaml", simulated("FIC-101"));
  const std::string draft = simulated("FIC-101", "monitor: {twin: ../twin.yaml}\n");
  CHECK(validate_all(folder.path()));
  CHECK_FALSE(validate_all(folder.path(), {{folder / "loops.d/a.yaml", draft}}));
}

TEST_CASE("a record of another period is no record of the loop", "[config][validation]") {
  const ScratchFolder folder;
  const std::string loop =
      with(kLoopHead, "stop: 1", "stop: 2") + "io: {backend: replay, record: ../r.csv}\n";
  folder.write("loops.d/a.yaml", loop);
  folder.write("r.csv", "time,pv\n0,1\n0.1,1\n0.2,1\n");
  CHECK(said_of(folder).empty());
  folder.write("r.csv", "time,pv\n0,1\n1,1\n2,1\n");
  CHECK(said_of(folder).find("its period is 1 s, the loop's sample time 0.1 s") !=
        std::string::npos);
  folder.write("r.csv", "nothing");
  CHECK_FALSE(said_of(folder).empty());
}

TEST_CASE("two links to one unit agree in their settings", "[config][validation]") {
  const ScratchFolder folder;
  const auto links = [&](const std::string& first, const std::string& second) {
    folder.write("loopwardend.yaml", "links:\n  old: {transport: tcp, " + first +
                                         "}\n  new: {transport: tcp, " + second + "}\n");
  };
  folder.write("loops.d/a.yaml", on_link("FIC-101", "old", 1, 100));
  folder.write("loops.d/b.yaml", on_link("FIC-102", "new", 1, 200));
  for (const char* other :
       {"host: 127.0.0.1, response_timeout: 0.5", "host: localhost, pause: 0.1",
        "host: \"::ffff:127.0.0.1\", reconnect_max: 5", "host: 0.0.0.0, connect_timeout: 2",
        "host: \"::1\", probe_interval: 9", "host: 127.0.0.1, connections: 1"}) {
    links("host: 127.0.0.1", other);
    const Validated validated = validate(folder.path());
    const Named said{folder.relative(to_text(validated.reading.diagnostics))};
    INFO(said.text);
    CHECK(
        said.contains("loops.d/b.yaml:19:11: error: io.transmitter.link: 'new' "
                      "(loopwardend.yaml:3:8) leads to "));
    CHECK(
        said.contains("link 'old' (loopwardend.yaml:2:8), which another loop uses "
                      "(loops.d/a.yaml:19:11). Use one link for both"));
    CHECK(std::count(said.text.begin(), said.text.end(), '\n') == 1);
    CHECK(tags_of(validated) == Tags{"FIC-101", "-FIC-102"});
    // Its output can be driven nevertheless.
    REQUIRE(validated.reading.outputs.size() == 2);
    CHECK(validated.reading.outputs[1].why_not.empty());
  }
  // The same settings under two names and spellings, another port, another device.
  for (const char* other : {"host: localhost", "host: 127.0.0.1, port: 5020, pause: 0.1",
                            "host: 127.0.0.2, pause: 0.1"}) {
    links("host: 127.0.0.1", other);
    CHECK(said_of(folder).empty());
  }
  // Units have separate connections, as long as no link limits these.
  folder.write("loops.d/b.yaml", on_link("FIC-102", "new", 2, 200));
  links("host: 127.0.0.1", "host: 127.0.0.1, response_timeout: 0.5");
  CHECK(said_of(folder).empty());
  links("host: 127.0.0.1", "host: 127.0.0.1, connections: 1");
  CHECK_FALSE(said_of(folder).empty());
}

TEST_CASE("one output is driven to its stop action only if all its loops agree on it",
          "[config][validation]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "links:\n  plc: {transport: tcp, host: 127.0.0.1}\n");
  const std::string first = on_link("FIC-101", "plc", 1, 100);
  folder.write("loops.d/a.yaml", first);
  folder.write("loops.d/c.yaml", on_link("FIC-103", "plc", 1, 300));
  const auto driven = [&] {
    std::vector<bool> is;
    for (const StopOutput& output : validate(folder.path()).reading.outputs) {
      is.push_back(output.why_not.empty());
    }
    return is;
  };
  using Driven = std::vector<bool>;
  const std::string second = on_link("FIC-102", "plc", 1, 100);
  folder.write("loops.d/b.yaml", second);
  CHECK(driven() == Driven{true, true, true});
  folder.write("loops.d/b.yaml", with(second, "stop: 1", "stop: 10"));
  CHECK(driven() == Driven{false, false, true});
  folder.write("loops.d/b.yaml", with(second, "scale: 0.001", "scale: 0.002"));
  CHECK(driven() == Driven{false, false, true});
  // The second of two registers.
  folder.write("loops.d/b.yaml",
               with(second, "address: 100, type: u16, scale: 0.001", "address: 99, type: f32"));
  CHECK(driven() == Driven{false, false, true});
}

TEST_CASE("a runtime directory that is a file is an error before the start",
          "[config][validation]") {
  const ScratchFolder folder;
  folder.write("m.yaml", kTwin);
  folder.write("loops.d/a.yaml", simulated("FIC-101"));
  folder.write("run", "");
  folder.write("loopwardend.yaml", "runtime_directory: run\n");
  CHECK(said_of(folder).find("loopwardend.yaml:1:20: error: runtime_directory: must be a folder, "
                             "or not exist yet") != std::string::npos);
  CHECK_FALSE(validate(folder.path()).reading.runnable);
  folder.write("loopwardend.yaml", "runtime_directory: loops.d\n");
  CHECK(said_of(folder).empty());
  folder.write("loopwardend.yaml", "runtime_directory: none/yet\n");
  CHECK(said_of(folder).empty());
}

TEST_CASE("one register has many names", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("loops.d/a.yaml", on_link("FIC-101", "old", 1, 100));
  folder.write("loops.d/b.yaml", on_link("FIC-102", "new", 1, 100));
  for (const char* host : {"localhost", "\"::ffff:127.0.0.1\"", "0.0.0.0", "\"::1\""}) {
    folder.write("loopwardend.yaml",
                 "links:\n  old: {transport: tcp, host: 127.0.0.1}\n"
                 "  new: {transport: tcp, host: " +
                     std::string(host) + "}\n");
    INFO(host);
    CHECK(said_of(folder).find("register 100 is written by another loop as well") !=
          std::string::npos);
    // It is unknown which of the two is right.
    CHECK_FALSE(validate(folder.path()).reading.runnable);
    CHECK(tags_of(validate(folder.path())) == Tags{"-FIC-101", "-FIC-102"});
  }
}

TEST_CASE("an analog output has a name and a label", "[config][validation]") {
  const ScratchFolder folder;
  const std::string root = "  iio_root: " + (folder / "iio").string() + "\n";
  const std::string loop =
      with(test::kAnalogLoop, "  backend: analog\n", "  backend: analog\n" + root);
  folder.write("loops.d/a.yaml", loop);
  folder.write("loops.d/b.yaml",
               with(with(loop, "FIC-101", "FIC-102"), "device: dac", "device: north"));
  CHECK(said_of(folder).empty());
  folder.write("iio/iio:device0/name", "dac\n");
  folder.write("iio/iio:device0/label", "north\n");
  folder.write("iio/iio:device1/name", "adc\n");
  CHECK(said_of(folder).find("north current1 is written by another loop") != std::string::npos);
}

TEST_CASE("a serial line is one link, by whatever name", "[config][validation]") {
  const ScratchFolder folder;
  std::filesystem::create_symlink("line", folder / "by-id");
  std::filesystem::create_symlink("by-id", folder / "by-path");
  const std::string path = folder.path().string();
  folder.write("loops.d/a.yaml", on_link("FIC-101", "old", 1, 100));
  folder.write("loops.d/b.yaml", on_link("FIC-102", "new", 2, 200));
  const auto said = [&](const std::string& device) {
    folder.write("loopwardend.yaml",
                 "links:\n  old: {transport: rtu, baud: 115200, device: " + path +
                     "/line}\n  new: {transport: rtu, baud: 115200, "
                     "device: " +
                     device + "}\n");
    return said_of(folder);
  };
  for (const bool there : {false, true}) {
    if (there) folder.write("line", "");
    for (const char* name : {"/line", "/by-id", "/by-path", "/./line", "//line"}) {
      INFO(name << there);
      CHECK(said(path + name).find("links.new.device: ") != std::string::npos);
      CHECK(tags_of(validate(folder.path())) == Tags{"FIC-101", "-FIC-102"});
    }
    CHECK(said(path + "/other").empty());
  }
  // The line on which the daemon is a slave.
  folder.write("loopwardend.yaml", "modbus_server: {serial: {device: " + path +
                                       "/by-id}}\nlinks:\n  old: {transport: rtu, device: " + path +
                                       "/line}\n  new: {transport: tcp, host: 10.0.0.1}\n");
  CHECK(said_of(folder).find("is the device of modbus_server.serial as well") != std::string::npos);
}

TEST_CASE("errors that only a start refused are refused", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("m.yaml", test::kModel);
  folder.write("loops.d/a.yaml", simulated("FIC-101"));
  const auto said = [&](const std::string& daemon) {
    folder.write("loopwardend.yaml", daemon);
    const Validated validated = validate(folder.path());
    CHECK_FALSE(validated.reading.runnable);
    return folder.relative(to_text(validated.reading.diagnostics));
  };
  CHECK(said("modbus_server: {address: 10.0.0.0/24}\n") ==
        "loopwardend.yaml:1:26: error: modbus_server.address: must be a numeric address (got "
        "'10.0.0.0/24')\n");
  CHECK(said("runtime_directory: /run/" + std::string(100, 'x') + "\n")
            .find("loopwardend.yaml:1:20: error: runtime_directory: must be shorter") == 0);
  folder.write("m.yaml", with(test::kModel, "sample_time: 0.1", "sample_time: 0.001"));
  folder.write("loops.d/a.yaml",
               with(simulated("FIC-101"), "sample_time: 0.1", "sample_time: 0.001"));
  CHECK(said("accelerate: 10000\n").find("accelerate: must be at most 100: FIC-101") !=
        std::string::npos);
}

TEST_CASE("a loop that is out of service keeps its place", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "feeders: {opcua: {user: root}}\n");
  folder.write("m.yaml", test::kModel);
  folder.write("loops.d/a.yaml", simulated("FIC-101"));
  folder.write("loops.d/b.yaml", simulated("FIC-102"));
  folder.write("loops.d/c.yaml", simulated("FIC-103"));
  const std::string watched =
      "loop: FIC-201\ncontrol: elsewhere\nsample_time: 1\n"
      "process_variable: {unit: L/min, range: [0, 10]}\noutput: {unit: V, range: [0, 10]}\n"
      "io: {backend: feed, pv: {feed: \"opcua:A\"}, co: {feed: \"opcua:B\"}}\n";
  folder.write("loops.d/aa.yaml", watched);
  const auto tags = [&] { return tags_of(validate(folder.path())); };
  CHECK(said_of(folder) == "");
  CHECK(tags() == Tags{"FIC-101", "FIC-102", "FIC-103", "FIC-201"});
  for (const std::string& bad :
       {with(simulated("FIC-102"), "kp: 0.35", "kp: x"), simulated("FIC-102") + "a: [1\n",
        std::string("loop: FIC-102\n")}) {
    folder.write("loops.d/b.yaml", bad);
    CHECK(tags() == Tags{"FIC-101", "-FIC-102", "FIC-103", "FIC-201"});
  }
  // Emptied by a power failure, or without any text: its file's name is its tag.
  for (const std::string& bad : {std::string(), std::string(3, '\0')}) {
    folder.write("loops.d/b.yaml", bad);
    CHECK(tags() == Tags{"FIC-101", "-b", "FIC-103", "FIC-201"});
  }
  folder.write("loops.d/b.yaml", simulated("FIC-102"));
  // Watched loops stay after the others, even if no part of their files can be read as YAML.
  folder.write("loops.d/aa.yaml", watched + "a: [1\n");
  CHECK(tags() == Tags{"FIC-101", "FIC-102", "FIC-103", "-FIC-201"});
  // Two loops of one tag: neither is run.
  folder.write("loops.d/aa.yaml", watched);
  folder.write("loops.d/c.yaml", simulated("FIC-102"));
  CHECK(tags() == Tags{"FIC-101", "-FIC-102", "-c", "FIC-201"});
  // An error in a section of loopwardend.yaml that belongs to no link concerns all loops.
  folder.write("loops.d/c.yaml", simulated("FIC-103"));
  folder.write("loopwardend.yaml", "feeders: {opcua: {user: root}}\nlog_levle: info\n");
  CHECK_FALSE(validate(folder.path()).reading.runnable);
}

TEST_CASE("a link with an error takes its own loops out of service", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("loops.d/a.yaml", on_link("FIC-101", "old", 1, 100));
  folder.write("loops.d/b.yaml", on_link("FIC-102", "new", 1, 200));
  const auto validated = [&](const std::string& link) {
    folder.write("loopwardend.yaml",
                 "links:\n  old: {transport: tcp, host: 10.0.0.1}\n  new: " + link + "\n");
    return validate(folder.path());
  };
  for (const char* link :
       {"{transport: tcp, host: plc}", "{transport: tcp, host: 10.0.0.2, prot: 1}",
        "{transport: tcp, host: 10.0.0.2, port: 0}", "{transport: udp}"}) {
    const Validated all = validated(link);
    INFO(link);
    CHECK(all.reading.runnable);
    CHECK(tags_of(all) == Tags{"FIC-101", "-FIC-102"});
    CHECK(all.reading.outputs[0].why_not.empty());
    CHECK_FALSE(all.reading.outputs[1].why_not.empty());
  }
  // The path to the device is right.
  const Validated all = validated("{transport: tcp, host: 10.0.0.2, pause: 9}");
  CHECK(tags_of(all) == Tags{"FIC-101", "-FIC-102"});
  CHECK(all.reading.outputs[1].why_not.empty());
}

TEST_CASE("an output is known if the path to it has no error", "[config][validation]") {
  const ScratchFolder folder;
  folder.write("loopwardend.yaml", "links:\n  skid: {transport: tcp, host: 127.0.0.1}\n");
  const auto known = [&](const std::string& from, const std::string& to) {
    INFO(from << " -> " << to);
    folder.write("loops.d/a.yaml", with(kModbusLoop, from, to));
    const Validated all = validate(folder.path());
    REQUIRE(all.reading.outputs.size() == 1);
    CHECK(out_of_service(all.reading.configuration.loops[0].io) != nullptr);
    const StopOutput& output = all.reading.outputs[0];
    if (output.why_not.empty()) {
      CHECK(output.loop.name == "FIC-101");
      CHECK(output.loop.safety.on_stop.value == 1.0);
      CHECK(std::get<hal::modbus::LoopModbusSettings>(output.loop.io).command.reg.address == 100);
    }
    return output.why_not.empty();
  };
  CHECK(known("kp: 0.35", "kp: x"));
  CHECK(known("bad_pv: hold", "bad_pv: 99"));
  CHECK(known("  bad_pv: hold\n", ""));
  CHECK(known("table: input", "table: inptu"));
  CHECK(known("    link: skid\n    unit: 1", "    link: skdi\n    unit: 1"));
  CHECK(known("comm_loss: {timeout: 2, set_by: device}", "comm_loss: none"));
  CHECK(known("set_point: 5", "set_point: 55"));
  CHECK(known("sample_time: 0.1", "sample_time: -1"));
  CHECK_FALSE(known("stop: 1\n", "stop: open\n"));
  CHECK_FALSE(known("stop: 1\n", "stop: 10\n"));
  CHECK_FALSE(known("  stop: 1\n", ""));
  CHECK_FALSE(known("limits: [1, 9]", "limits: [1, 99]"));
  CHECK_FALSE(known("    link: skid\n    unit: 2", "    link: skdi\n    unit: 2"));
  CHECK_FALSE(known("unit: 2", "unit: 999"));
  CHECK_FALSE(known("address: 100", "adress: 100"));
  CHECK_FALSE(known("scale: 0.001", "scal: 0.001"));
  CHECK_FALSE(known("address: 100", "address: x"));
}

}  // namespace validation_test
