// SPDX-License-Identifier: Apache-2.0
// The real daemon's Modbus server, read and written by foreign masters: pymodbus and mbpoll, with
// the snippets that the project generates for them.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "model/alarm/alarm_kind.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::modbus_server_test {
namespace {

using nlohmann::json;

ShellOutcome answer_of(const std::string& command) { return run(command + " 2>&1"); }

struct Plant {
  explicit Plant(const std::string& server)
      : port(free_port()),
        daemon(
            "real_time: {priority: 0, lock_memory: false}\nmodbus_server:\n  port: " +
                std::to_string(port) + "\n" + server,
            {{"loops.d/1.yaml", loop_file("FIC-101")}, {"loops.d/2.yaml", loop_file("FIC-102")}}) {
    daemon.start();
    for (const char* loop : {"FIC-101", "FIC-102"}) {
      if (!test::eventually([&] { return daemon.is(loop, "mode", "AUTO"); })) {
        throw std::runtime_error(std::string(loop) + " does not start");
      }
    }
  }
  std::string snippet(const char* format) {
    const std::string file = (daemon.folder() / format).string();
    const ShellOutcome made =
        answer_of(std::string(LOOPWARDEN_CLI " register-map --format ") + format + " --config " +
                  daemon.config().string() + " > " + file);
    INFO(made.text);
    REQUIRE(made.exit_code == 0);
    return file;
  }
  std::string mbpoll(const std::string& arguments) const {
    return "mbpoll -q -1 -0 -B -o 10 -m tcp -p " + std::to_string(port) + " " + arguments;
  }

  int port;
  DaemonProcess daemon;
};

// Two serial ports and the line between them.
class Wire {
 public:
  Wire(const std::string& one, const std::string& other) : child_(::fork()) {
    REQUIRE(child_ >= 0);
    if (child_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::execl("/usr/bin/socat", "socat", ("pty,raw,echo=0,link=" + one).c_str(),
            ("pty,raw,echo=0,link=" + other).c_str(), nullptr);
    ::_exit(127);
  }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  ~Wire() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

 private:
  pid_t child_;
};

// Returns whether a value that a master read is among the recent values of the loop.
bool seen(const std::vector<double>& values, double read) {
  return std::any_of(values.begin(), values.end(),
                     [&](double v) { return static_cast<float>(v) == static_cast<float>(read); });
}

void check_against_top(Plant& plant, const json& read) {
  CHECK(read.at("input register:box.magic") == 0x4C50);
  CHECK(read.at("input register:box.float_test") == 123456.0);
  CHECK(read.at("input register:box.integer_test") == 0x01020304);
  CHECK(read.at("input register:box.loop_count") == 2);
  const json status = plant.daemon.status();
  CHECK(read.at("input register:box.config_hash") == status.at("daemon").at("config_hash"));
  for (const json& loop : status.at("loops")) {
    const std::string tag = loop.at("name");
    const auto value = [&](const char* table, const char* name) {
      return read.at(std::string(table) + ":" + tag + "." + name).get<double>();
    };
    const protocol::Trend trend = plant.daemon.trend(tag);
    INFO(tag);
    CHECK(seen(trend.pv, value("input register", "pv")));
    CHECK(seen(trend.co, value("input register", "co")));
    CHECK(seen(trend.stem, value("input register", "stem")));
    CHECK(seen(trend.co, value("holding register", "output")));
    CHECK(value("input register", "sp") == loop.at("sp"));
    CHECK(value("input register", "sp_scaled") == Approx(10.0 * loop.at("sp").get<double>()));
    CHECK(value("input register", "pv_scaled") ==
          Approx(10.0 * value("input register", "pv")).margin(2.0));
    CHECK(value("input register", "mode") == 1);
    CHECK(value("input register", "pv_quality") == 192);
    CHECK(value("input register", "ne107") == 3);  // simulated: function check
    CHECK(value("input register", "fault") == 0);
    CHECK(value("holding register", "sp") == 5.0);
    CHECK(value("holding register", "kp") == Approx(0.35));
    CHECK(value("holding register", "ki") == Approx(0.04));
    CHECK(value("discrete input", "in_manual") == 0);
    CHECK(value("coil", "acknowledge_stiction") == 0);
    // The decisions of the monitor.
    const json& monitor = loop.at("monitor");
    CHECK(value("input register", "window_number") == monitor.at("windows"));
    for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
      const std::string name = to_text(kind);
      const json& alarm = loop.at("alarms").at(name);
      const char* table = name == "model_gap" ? "holding register" : "input register";
      CHECK(value(table, ("alarm_" + name).c_str()) == (alarm.at("state") == "suppressed" ? 7 : 0));
    }
  }
}

}  // namespace

TEST_CASE(
    "pymodbus reads every register, in each offered word order, and gets the values that top shows",
    "[modbus_server]") {
  const std::string order = GENERATE(as<std::string>(), "abcd", "cdab", "badc", "dcba");
  INFO(order);
  Plant plant("  word_order: " + order + "\n");
  const ShellOutcome out = answer_of("/usr/bin/python3 " + plant.snippet("pymodbus"));
  INFO(out.text);
  REQUIRE(out.exit_code == 0);
  check_against_top(plant, json::parse(out.text));
}

TEST_CASE("mbpoll reads every register with the script made for it, with names, signs and scales",
          "[modbus_server]") {
  const std::string order = GENERATE(as<std::string>(), "abcd", "cdab");
  Plant plant("  word_order: " + order + "\n  request_rate: 1000\n");
  const ShellOutcome out = answer_of("bash " + plant.snippet("mbpoll"));
  INFO(out.text);
  CHECK(out.exit_code == 0);
  std::istringstream lines(out.text);
  std::map<std::string, double> values;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t value = line.rfind(' ');
    values[line.substr(0, line.find_last_not_of(' ', value) + 1)] =
        std::strtod(line.c_str() + value, nullptr);
  }
  CHECK(values.size() > 250);
  const auto value = [&](const char* name) {
    return values.at(std::string("input register:") + name);
  };
  CHECK(value("box.magic") == 0x4C50);
  CHECK(value("box.float_test") == 123456.0);
  CHECK(value("box.integer_test") == 0x01020304);
  CHECK(value("FIC-101.sp") == 5.0);
  CHECK(value("FIC-102.sp_scaled") == 50.0);
  CHECK(value("FIC-102.condition_valve") == -327.68);
  CHECK(value("box.config_hash") == plant.daemon.status().at("daemon").at("config_hash"));
}

TEST_CASE("writes are refused or accepted as configured, and end in the journal",
          "[modbus_server]") {
  SECTION("off") {
    Plant plant("");
    const ShellOutcome out = answer_of(plant.mbpoll("-t 4:float -r 34 127.0.0.1 4.5"));
    CHECK(out.text.find("Illegal function") != std::string::npos);
    CHECK(plant.daemon.journal(50).empty());
  }
  SECTION("on, but not for this client") {
    Plant plant("  writes: true\n  clients: [{peer: 127.0.0.1}, {peer: 10.0.0.1, writes: true}]\n");
    const ShellOutcome out = answer_of(plant.mbpoll("-t 4:float -r 34 127.0.0.1 4.5"));
    CHECK(out.text.find("Illegal function") != std::string::npos);
  }
  SECTION("on") {
    Plant plant("  writes: true\n  clients: [{peer: 127.0.0.1, writes: true}]\n");
    const auto loop = [&](const char* key) { return plant.daemon.loop("FIC-102").at(key); };
    CHECK(answer_of(plant.mbpoll("-t 4:float -r 66 127.0.0.1 4.5")).exit_code == 0);
    CHECK(test::eventually([&] { return loop("sp") == 4.5; }));
    CHECK(plant.daemon.loop("FIC-101").at("sp") == 5.0);
    // Manual, and an output.
    CHECK(answer_of(plant.mbpoll("-t 4 -r 64 127.0.0.1 0")).exit_code == 0);
    CHECK(test::eventually([&] { return loop("mode") == "MAN"; }));
    CHECK(answer_of(plant.mbpoll("-t 4:float -r 68 127.0.0.1 2.5")).exit_code == 0);
    CHECK(test::eventually([&] { return std::abs(loop("co").get<double>() - 2.5) < 1e-6; }));
    // Gains, read back.
    CHECK(answer_of(plant.mbpoll("-t 4:float -r 70 127.0.0.1 0.25")).exit_code == 0);
    CHECK(answer_of(plant.mbpoll("-t 4:float -r 70 -c 1 127.0.0.1")).text.find("0.25") !=
          std::string::npos);
    // Out of limits, and half of a number.
    CHECK(
        answer_of(plant.mbpoll("-t 4:float -r 66 127.0.0.1 9.5")).text.find("Illegal data value") !=
        std::string::npos);
    CHECK(answer_of(plant.mbpoll("-t 4 -r 66 127.0.0.1 7")).text.find("Illegal data value") !=
          std::string::npos);
    CHECK(answer_of(plant.mbpoll("-t 4 -r 90 127.0.0.1 7")).text.find("Illegal data address") !=
          std::string::npos);
    CHECK(answer_of(plant.mbpoll("-t 0 -r 16 127.0.0.1 1")).exit_code ==
          0);  // no alarm to acknowledge
    bool written = false;
    bool refused = false;
    for (const json& line : plant.daemon.journal(50, "FIC-102")) {
      if (line.at("what") != "sp") continue;
      CHECK(line.at("peer").get<std::string>().rfind("127.0.0.1:", 0) == 0);
      written = written ||
                (line.at("old") == "5" && line.at("new") == "4.5" && line.at("result") == "done");
      refused = refused || (line.at("new") == "9.5" && line.at("result") != "done");
    }
    CHECK(written);
    CHECK(refused);
  }
}

TEST_CASE("a command that can't act is refused on every way in, and the journal has it as refused",
          "[modbus_server]") {
  Plant plant("  writes: true\n  clients: [{peer: 127.0.0.1, writes: true}]\n");
  const auto loop = [&](const char* key) { return plant.daemon.loop("FIC-102").at(key); };
  const auto set = [&](const std::string& arguments) {
    return answer_of(LOOPWARDEN_CLI " set FIC-102 --socket " +
                     (plant.daemon.folder() / "control.sock").string() + " " + arguments);
  };
  // Writes mode, a reserved register, sp and output in one request. Prints the exception, or None
  // if the write was done.
  const auto block = [&](int mode, double sp, double output) {
    return answer_of(
               "/usr/bin/python3 -c \"import struct; from pymodbus.client import ModbusTcpClient "
               "as C; "
               "c = C('127.0.0.1', port=" +
               std::to_string(plant.port) +
               "); c.connect(); f = lambda v: list(struct.unpack('>HH', struct.pack('>f', v))); "
               "r = c.write_registers(64, [" +
               std::to_string(mode) + ", 0] + f(" + std::to_string(sp) + ") + f(" +
               std::to_string(output) +
               "), slave=1); print('exception', getattr(r, 'exception_code', None))\"")
        .text;
  };
  const auto written = [&](double co) {
    return test::eventually([&] { return std::abs(loop("co").get<double>() - co) < 1e-6; });
  };
  // Automatic: the controller has the output.
  CHECK(set("--output 2.5").exit_code == 65);
  CHECK_THAT(set("--output 2.5").text,
             Catch::Contains("in automatic the controller has the output"));
  CHECK_THAT(answer_of(plant.mbpoll("-t 4:float -r 68 127.0.0.1 2.5")).text,
             Catch::Contains("busy"));
  CHECK(loop("mode") == "AUTO");
  // Mode and output together, mode first.
  const ShellOutcome both = set("--output 2.5 --mode man");
  INFO(both.text);
  CHECK(both.exit_code == 0);
  CHECK_THAT(both.text, Catch::Contains("after:  mode MAN (wanted MAN)"));
  CHECK_THAT(both.text, Catch::Contains("CO 2.5 V"));
  CHECK(set("--sp 4").exit_code == 65);
  CHECK(set("--sp 9.5").exit_code == 65);
  CHECK_THAT(answer_of(plant.mbpoll("-t 4:float -r 66 127.0.0.1 4")).text, Catch::Contains("busy"));
  CHECK(set("--sp 4 --mode auto").exit_code == 0);
  CHECK(loop("mode") == "AUTO");
  CHECK(loop("sp") == 4.0);
  // The same in one request of a master, with the set point that is in force.
  CHECK_THAT(block(0, 6.0, 3.5), Catch::Contains("exception 6"));
  CHECK_THAT(block(0, 4.0, 10.5), Catch::Contains("exception 3"));
  CHECK(loop("mode") == "AUTO");
  CHECK_THAT(block(0, 4.0, 3.5), Catch::Contains("exception None"));
  CHECK(written(3.5));
  CHECK_THAT(block(1, 5.5, 3.5), Catch::Contains("exception None"));
  CHECK(test::eventually([&] { return loop("mode") == "AUTO" && loop("sp") == 5.5; }));

  const auto in_journal = [&](const char* kind, const char* what, const char* after,
                              const std::string& result) {
    INFO(kind << " " << what << " " << after << " " << result);
    CHECK(test::eventually([&] {
      for (const json& line : plant.daemon.journal(200, "FIC-102")) {
        if (line.at("kind") == kind && line.at("what") == what && line.at("new") == after &&
            line.at("result").get<std::string>().rfind(result, 0) == 0 &&
            !line.at("peer").get<std::string>().empty()) {
          return true;
        }
      }
      return false;
    }));
  };
  in_journal("operator", "output", "2.5", "refused: in automatic");
  in_journal("operator", "mode", "MAN", "done");
  in_journal("operator", "output", "2.5", "done");
  in_journal("operator", "set point", "4", "refused: in manual");
  in_journal("operator", "set point", "9.5", "refused: set point must be within 0 to 9");
  in_journal("operator", "set point", "4", "done");
  in_journal("register", "output", "2.5", "refused: in automatic");
  in_journal("register", "sp", "4", "refused: in manual");
  in_journal("register", "output", "10.5", "refused: output must be within 0 to 10");
  in_journal("register", "output", "3.5", "done");
  in_journal("register", "sp", "5.5", "done");
}

TEST_CASE("the same map on a serial line: mbpoll and pymodbus as masters of an RTU slave",
          "[modbus_server]") {
  const TemporaryFolder line;
  const std::string ours = (line / "ours").string();
  const std::string theirs = (line / "theirs").string();
  const Wire wire(ours, theirs);
  REQUIRE(test::eventually(
      [&] { return std::filesystem::exists(ours) && std::filesystem::exists(theirs); }));
  const bool writes = GENERATE(false, true);
  Plant plant("  writes: true\n  serial: {device: " + ours +
              ", unit: 9, parity: none, writes: " + (writes ? "true" : "false") + "}\n");
  const std::string rtu = "mbpoll -q -1 -0 -B -o 10 -m rtu -a 9 -b 19200 -P none ";
  const ShellOutcome test_constant = answer_of(rtu + "-t 3:float -r 14 -c 1 " + theirs);
  INFO(test_constant.text);
  CHECK(test_constant.text.find("123456") != std::string::npos);
  const ShellOutcome write = answer_of(rtu + "-t 4:float -r 66 " + theirs + " 4.5");
  INFO(write.text);
  if (writes) {
    CHECK(test::eventually([&] { return plant.daemon.loop("FIC-102").at("sp") == 4.5; }));
    // The journal line is written when the loop's answer is there.
    CHECK(test::eventually([&] {
      const json lines = plant.daemon.journal(20, "FIC-102");
      return std::any_of(lines.begin(), lines.end(), [&](const json& entry) {
        return entry.at("what") == "sp" && entry.at("peer") == ours;
      });
    }));
  } else {
    CHECK(write.text.find("Illegal function") != std::string::npos);
  }
  // A whole block, and another unit without a device.
  const ShellOutcome block = answer_of(
      "/usr/bin/python3 -c \"from pymodbus.client import ModbusSerialClient as C; "
      "c = lambda s: C(port='" +
      theirs +
      "', baudrate=19200, parity='N', timeout=s); "
      "r = c(20).read_input_registers(64, 64, slave=9); print(len(r.registers), r.registers[0] == "
      "r.registers[63]); print(c(1).read_input_registers(0, 1, slave=8).isError())\"");
  INFO(block.text);
  CHECK(block.text.find("64 True") != std::string::npos);
  CHECK(block.text.find("\nTrue") != std::string::npos);
  const json serial = plant.daemon.status().at("daemon").at("modbus_server").at("serial");
  CHECK(serial.at("open") == true);
  CHECK(serial.at("requests") >= 3);
}

TEST_CASE("the master's heartbeat: when it stops, the loops follow the configuration",
          "[modbus_server]") {
  Plant plant(
      "  writes: true\n  clients: [{peer: 127.0.0.1, writes: true}]\n"
      "  master_heartbeat: {timeout: 2, action: manual}\n");
  CHECK(answer_of(plant.mbpoll("-t 4 -r 0 127.0.0.1 1")).exit_code == 0);
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-101", "mode", "MAN"); }));
  CHECK(test::eventually([&] { return plant.daemon.is("FIC-102", "mode", "MAN"); }));
  CHECK(answer_of(plant.mbpoll("-t 1 -r 5 -c 1 127.0.0.1")).text.find("[5]: \t1") !=
        std::string::npos);
  // Alive as long as the heartbeat changes.
  int beat = 1;
  CHECK(test::eventually([&] {
    beat = beat % 1000 + 1;
    CHECK(answer_of(plant.mbpoll("-t 4 -r 0 127.0.0.1 " + std::to_string(beat))).exit_code == 0);
    return answer_of(plant.mbpoll("-t 1 -r 5 -c 1 127.0.0.1")).text.find("[5]: \t0") !=
           std::string::npos;
  }));
}

TEST_CASE("hostile clients: no additional overrun, no crash, and the others are served",
          "[modbus_server]") {
  Plant plant("  max_clients: 16\n");
  const auto connect = [&] {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(plant.port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    return fd;
  };
  std::mt19937 random(5);
  std::vector<int> crowd(200, -1);
  for (int& fd : crowd) fd = connect();
  const std::array<std::uint8_t, 12> sound{0, 1, 0, 0, 0, 6, 1, 4, 0, 64, 0, 64};
  for (int round = 0; round < 60; ++round) {
    for (int& fd : crowd) {
      std::array<std::uint8_t, 12> bytes = sound;
      switch (random() % 4) {
        case 0: ::send(fd, bytes.data(), 1, MSG_NOSIGNAL); break;  // half a frame
        case 1:
          for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
          ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
          break;
        case 2:
          bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
          ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
          break;
        default:
          ::close(fd);
          fd = connect();
          break;
      }
    }
    if (round % 10 != 9) continue;
    const ShellOutcome out = answer_of(plant.mbpoll("-t 3:float -r 14 -c 1 127.0.0.1"));
    INFO(out.text);
    CHECK(out.text.find("123456") != std::string::npos);
  }
  for (const int fd : crowd) ::close(fd);
  const json daemon = plant.daemon.status().at("daemon");
  CHECK(daemon.at("modbus_server").at("malformed") > 0);
  CHECK(daemon.at("modbus_server").at("clients") <= 16);
  CHECK(plant.daemon.is("FIC-101", "mode", "AUTO"));
  plant.daemon.signal(SIGTERM);
  CHECK(plant.daemon.wait_for_end() == 0);
}

}  // namespace loopwarden::tests::modbus_server_test
