// SPDX-License-Identifier: Apache-2.0
#include "config/modbus_reader.hpp"

#include "tests/config/config_support.hpp"

namespace modbus_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using namespace loopwarden::hal::modbus;
using test::kModbusLoop;
using test::said_of_loop;
using test::with;

namespace {

LoopModbusSettings read(const std::string& text) {
  const auto loop = read_loop_text("loop.yaml", text, test::daemon());
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  return std::get<LoopModbusSettings>(loop->io);
}

std::string with_comm_loss(const std::string& value) {
  return with(kModbusLoop, "{timeout: 2, set_by: device}", value);
}

}  // namespace

TEST_CASE("A Modbus loop knows its devices and registers", "[config][modbus]") {
  const LoopModbusSettings io = read(
      with(kModbusLoop, "    comm_loss",
           "    read_back: {table: holding, address: 0x20, type: i32, order: cdab, scale: 0.5,\n"
           "                offset: -1, status: {table: input, address: 7, mask: 0x3, value: 1}}\n"
           "    resolution: 0.05\n    comm_loss"));
  CHECK(io.transmitter_link.name == "skid");
  CHECK(io.process_variable.unit == 1);
  CHECK(io.process_variable.reg.table == Table::input_register);
  CHECK(io.process_variable.reg.type == RegisterType::f32);
  CHECK(io.positioner_link.name == "skid");
  CHECK(io.command.unit == 2);
  CHECK(io.command.reg.table == Table::holding_register);
  CHECK(io.command.reg.address == 100);
  CHECK(io.command.reg.scale == 0.001);
  REQUIRE(io.read_back);
  CHECK(io.read_back->unit == 2);
  CHECK(io.read_back->reg.address == 0x20);
  CHECK(io.read_back->reg.order == ByteOrder::cdab);
  CHECK(io.read_back->reg.offset == -1.0);
  REQUIRE(io.read_back->status);
  CHECK(io.read_back->status->mask == 3);
  CHECK(io.output.low == 0.0);
  CHECK(io.output.high == 10.0);
  CHECK(io.output.resolution == 0.05);
  CHECK(io.poll_period_ns == 100'000'000);  // the sample time
  for (const PointSettings* point : {&io.process_variable, &io.command, &*io.read_back}) {
    CHECK(point->max_age_ns == 300'000'000);  // three sample times
  }
  CHECK_FALSE(io.max_command_age_ns);
}

TEST_CASE("The action without commands must be stated", "[config][modbus]") {
  CHECK(
      said_of_loop(with(kModbusLoop, "    comm_loss: {timeout: 2, set_by: device}\n", "")) ==
      "loop.yaml:23:5: error: io.positioner: missing key 'comm_loss' ({timeout, register, value}, "
      "{timeout, set_by: device} or none_accepted). When the link is down, or this process is "
      "killed "
      "or stopped, only the device's own watchdog can bring the valve to a safe place: state the "
      "protection, or accept that the device has none\n");

  CHECK(read(with_comm_loss("none_accepted")).comm_loss.protection ==
        CommLossProtection::none_accepted);
  const CommLossSettings by_device = read(kModbusLoop).comm_loss;
  CHECK(by_device.protection == CommLossProtection::set_by_device);
  CHECK(by_device.timeout_s == 2.0);
  const CommLossSettings by_register =
      read(with_comm_loss("{timeout: 3, register: {address: 9, type: u16, scale: 0.1}, value: 3}"))
          .comm_loss;
  CHECK(by_register.protection == CommLossProtection::watchdog_register);
  REQUIRE(by_register.watchdog);
  CHECK(by_register.watchdog->value == 3.0);
  CHECK(by_register.watchdog->point.unit == 2);
  CHECK(by_register.watchdog->point.reg.address == 9);

  // All forms of a value that does not state who acts.
  for (const char* value : {"none", "{timeout: 2}", "{timeout: 2, value: 3}", "[timeout, 2]"}) {
    INFO(value);
    CHECK(said_of_loop(with_comm_loss(value)) ==
          "loop.yaml:26:16: error: io.positioner.comm_loss: must be {timeout, register, value}, "
          "{timeout, set_by: device} or none_accepted\n");
  }
  CHECK_THAT(said_of_loop(with_comm_loss("{timeout: 2, set_bye: device}")),
             Catch::Contains("or none_accepted") && Catch::Contains("did you mean 'set_by'?"));
  // 0.1 s polls and 0.3 s response timeout: a single lost reply takes 0.8 s.
  CHECK(said_of_loop(with_comm_loss("{timeout: 0.8, set_by: device}")) ==
        "loop.yaml:26:26: error: io.positioner.comm_loss.timeout: must be longer than two poll "
        "periods "
        "of 0.1 s and two response timeouts of 0.3 s, 0.8 s, or one lost reply trips the watchdog "
        "(got "
        "0.8)\n");
}

TEST_CASE("Links and units must exist", "[config][modbus]") {
  CHECK(said_of_loop(with(kModbusLoop, "link: skid", "link: skit")) ==
        "loop.yaml:19:11: error: io.transmitter.link: no link 'skit' in loopwardend.yaml; did you "
        "mean "
        "'skid'?\n");
  CHECK(said_of_loop(with(kModbusLoop, "unit: 1", "unit: 248")) ==
        "loop.yaml:20:11: error: io.transmitter.unit: must be 1 to 247, 0 or 255 (got 248)\n");
  CHECK(said_of_loop(with(kModbusLoop, "unit: 1", "unit: 255")).empty());
  const std::string serial = with(kModbusLoop, "link: skid", "link: line");
  CHECK(said_of_loop(with(serial, "unit: 1", "unit: 0")) ==
        "loop.yaml:20:11: error: io.transmitter.unit: must be 1 to 247 (got 0)\n");
}

TEST_CASE("Impossible registers are refused", "[config][modbus]") {
  CHECK(said_of_loop(with(kModbusLoop, "address: 0, type: f32", "address: 65535, type: f32")) ==
        "loop.yaml:21:39: error: io.transmitter.register.address: 2 registers from 65535 on reach "
        "beyond 65535\n");
  CHECK(said_of_loop(with(kModbusLoop, "address: 0, type: f32", "address: 65536, type: f32")) ==
        "loop.yaml:21:39: error: io.transmitter.register.address: must be a whole number from 0 to "
        "65535 (got 65536)\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "type: f32", "type: i16, order: cdab")) ==
      "loop.yaml:21:60: error: io.transmitter.register.order: must be abcd or badc (swapped bytes) "
      "for a type of one register (type at 21:48)\n");
  CHECK(said_of_loop(with(kModbusLoop, "scale: 0.001", "scale: 0")) ==
        "loop.yaml:25:47: error: io.positioner.command.scale: must not be 0\n");
  CHECK(said_of_loop(
            with(kModbusLoop, "type: u16, scale: 0.001", "type: f32, write_function: single")) ==
        "loop.yaml:25:56: error: io.positioner.command.write_function: single writes one register, "
        "the "
        "type (at 25:35) takes 2\n");
  CHECK(said_of_loop(with(kModbusLoop, "{address: 100,", "{table: input, address: 100,")) ==
        "loop.yaml:25:22: error: io.positioner.command.table: must be holding (got 'input')\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "type: f32}",
                        "type: f32}\n    status: {table: input, address: 4, mask: 1, value: 2}")) ==
      "loop.yaml:22:56: error: io.transmitter.status.value: has bits outside mask (at 22:46): it "
      "could never match\n");
}

TEST_CASE("The command's register must hold every output of the loop", "[config][modbus]") {
  CHECK(said_of_loop(with(kModbusLoop, "scale: 0.001", "scale: 0.0001")) ==
        "loop.yaml:25:14: error: io.positioner.command: holds 0 to 6.5535 CO units by its "
        "type and scale, which does not cover the output range [0, 10] (at 9:28)\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "scale: 0.001", "scale: 1")) ==
      "loop.yaml:25:14: warning: io.positioner.command: its steps of 1 CO units are coarse for the "
      "output range [0, 10] (at 9:28)\n");
  CHECK(said_of_loop(with(kModbusLoop, "type: u16, scale: 0.001", "type: f32")).empty());
}

TEST_CASE("raw and eu state the line that scale and offset would", "[config][modbus]") {
  const LoopModbusSettings io =
      read(with(with(kModbusLoop, "type: f32}", "type: i16, raw: [0, 27648], eu: [-2, 10]}"),
                "type: u16, scale: 0.001", "type: i16, raw: [-27648, 27648], eu: [10, 0]"));
  const auto at = [](const RegisterSpec& spec, double raw) {
    return raw * spec.scale + spec.offset;
  };
  CHECK(at(io.process_variable.reg, 0) == Approx(-2.0));
  CHECK(at(io.process_variable.reg, 27648) == Approx(10.0));
  CHECK(at(io.process_variable.reg, 13824) == Approx(4.0));
  CHECK(at(io.process_variable.reg, 32511) == Approx(-2.0 + 12.0 * 32511.0 / 27648.0));
  // A falling eu: the counts fall as CO rises.
  CHECK(at(io.command.reg, -27648) == Approx(10.0));
  CHECK(at(io.command.reg, 27648) == Approx(0.0).margin(1e-12));
}

TEST_CASE("raw and eu are checked like any other scale", "[config][modbus]") {
  const auto command = [](const std::string& keys) {
    return said_of_loop(with(kModbusLoop, "type: u16, scale: 0.001", keys));
  };
  CHECK(command("type: u16, raw: [0, 27648], eu: [0, 10]").empty());
  CHECK(command("type: u16, raw: [0, 27648]") ==
        "loop.yaml:25:45: error: io.positioner.command.raw: needs eu as well: the engineering "
        "values at these two\n");
  CHECK(command("type: u16, eu: [0, 10]") ==
        "loop.yaml:25:44: error: io.positioner.command.eu: needs raw as well: the register's "
        "values at these two\n");
  CHECK(command("type: u16, raw: [0, 27648], eu: [0, 10], scale: 0.001, offset: 0") ==
        "loop.yaml:25:77: error: io.positioner.command.scale: conflicts with raw (at 25:45); give "
        "raw "
        "and eu, or scale and offset\n"
        "loop.yaml:25:92: error: io.positioner.command.offset: conflicts with raw (at 25:45); give "
        "raw "
        "and eu, or scale and offset\n");
  CHECK(
      command("type: u16, raw: [27648, 0], eu: [0, 10]") ==
      "loop.yaml:25:45: error: io.positioner.command.raw: must be [low, high] with low below high "
      "(got [27648, 0])\n");
  CHECK(
      command("type: u16, raw: [5, 5], eu: [0, 10]") ==
      "loop.yaml:25:45: error: io.positioner.command.raw: must be [low, high] with low below high "
      "(got [5, 5])\n");
  CHECK(command("type: u16, raw: [0, 27648], eu: [10, 10]") ==
        "loop.yaml:25:61: error: io.positioner.command.eu: must be [first, last], two different "
        "numbers (got [10, 10])\n");
  CHECK(command("type: i16, raw: [0, 65535], eu: [0, 10]") ==
        "loop.yaml:25:45: error: io.positioner.command.raw: must lie within -32768 to 32767, which "
        "the type (at 25:35) holds (got [0, 65535])\n");
  CHECK(command("type: f64, raw: [0, 1e-300], eu: [0, 1e300]") ==
        "loop.yaml:25:62: error: io.positioner.command.eu: and raw differ too much in size to be "
        "scaled\n");
  CHECK(command("type: u16, raw: [0, 27648], eu: 10") ==
        "loop.yaml:25:61: error: io.positioner.command.eu: must be [first, last], CO units\n");
}

TEST_CASE("A range that eu does not cover is reported", "[config][modbus]") {
  // The type reaches to 18.96 V, the device to 8 V.
  CHECK(
      said_of_loop(
          with(kModbusLoop, "type: u16, scale: 0.001", "type: u16, raw: [0, 27648], eu: [0, 8]")) ==
      "loop.yaml:25:61: warning: io.positioner.command.eu: does not cover the output range [0, 10] "
      "(at 9:28), for which the register would have to go beyond raw\n");
  // The type does not cover it either.
  CHECK(
      said_of_loop(
          with(kModbusLoop, "type: u16, scale: 0.001", "type: u16, raw: [0, 27648], eu: [0, 4]")) ==
      "loop.yaml:25:14: error: io.positioner.command: holds 0 to 9.48134 CO units by its type and "
      "scale, which does not cover the output range [0, 10] (at 9:28)\n"
      "loop.yaml:25:61: warning: io.positioner.command.eu: does not cover the output range [0, 10] "
      "(at 9:28), for which the register would have to go beyond raw\n");
  CHECK(said_of_loop(with(kModbusLoop, "type: f32}", "type: u16, raw: [0, 27648], eu: [0, 4]}")) ==
        "loop.yaml:21:74: warning: io.transmitter.register.eu: does not cover the range of PV [0, "
        "10] "
        "(at 3:40), for which the register would have to go beyond raw\n");
  CHECK(said_of_loop(with(kModbusLoop, "type: f32}", "type: u16, raw: [0, 27648], eu: [12, 0]}"))
            .empty());
}

TEST_CASE("Byte orders are accepted in either case, other words for types get an answer",
          "[config][modbus]") {
  CHECK(read(with(kModbusLoop, "type: f32", "type: f32, order: CDAB")).process_variable.reg.order ==
        ByteOrder::cdab);
  CHECK(read(with(kModbusLoop, "type: f32", "type: f32, order: Badc")).process_variable.reg.order ==
        ByteOrder::badc);
  CHECK(said_of_loop(with(kModbusLoop, "type: f32", "type: f32, order: CDBA")) ==
        "loop.yaml:21:60: error: io.transmitter.register.order: must be abcd, cdab, badc or dcba "
        "(got 'CDBA'); did you mean 'cdab'?\n");
  const auto [written, meant] = GENERATE(table<std::string, std::string>({{"float32", "f32"},
                                                                          {"Float32", "f32"},
                                                                          {"REAL", "f32"},
                                                                          {"float", "f32"},
                                                                          {"double", "f64"},
                                                                          {"LREAL", "f64"},
                                                                          {"uint16", "u16"},
                                                                          {"WORD", "u16"},
                                                                          {"INT", "i16"},
                                                                          {"int16", "i16"},
                                                                          {"UDINT", "u32"},
                                                                          {"DINT", "i32"},
                                                                          {"F32", "f32"}}));
  CHECK(said_of_loop(with(kModbusLoop, "type: f32", "type: " + written)) ==
        "loop.yaml:21:48: error: io.transmitter.register.type: must be u16, i16, u32, i32, f32 or "
        "f64 (got '" +
            written + "'); did you mean '" + meant + "'?\n");
}

TEST_CASE("A register's number out of a manual gets an error with its address",
          "[config][modbus]") {
  const auto pv = [](const std::string& address) {
    return said_of_loop(with(kModbusLoop, "address: 0", "address: " + address));
  };
  const std::string at = "loop.yaml:21:39: error: io.transmitter.register.address: ";
  const std::string holding =
      " is holding register 200 counted from 0: write `table: holding`, "
      "`address: 200`\n";
  CHECK(pv("400201") ==
        at + "must be a whole number from 0 to 65535 (got 400201). 400201" + holding);
  CHECK(pv("465536") ==
        at + "must be a whole number from 0 to 65535 (got 465536). 465536 is holding "
             "register 65535 counted from 0: write `table: holding`, `address: "
             "65535`\n");
  CHECK(pv("300011") == at + "must be a whole number from 0 to 65535 (got 300011). 300011 is input "
                             "register 10 counted from 0: write `table: input`, `address: 10`\n");
  CHECK(pv("'40201'") == at + "must be a number (got text in quotes, '40201'). 40201" + holding);
  CHECK(pv("4x0201") == at + "must be a number (got '4x0201'). 4x0201" + holding);
  CHECK(pv("4X00201") == at + "must be a number (got '4X00201'). 4X00201" + holding);
  // These are no numbers of a manual: the table would end before them, or it has no register 0.
  CHECK(pv("465537") == at + "must be a whole number from 0 to 65535 (got 465537)\n");
  CHECK(pv("400000") == at + "must be a whole number from 0 to 65535 (got 400000)\n");
  CHECK(pv("999999") == at + "must be a whole number from 0 to 65535 (got 999999)\n");
  CHECK(said_of_loop(with(kModbusLoop, "address: 100", "address: '30011'")) ==
        "loop.yaml:25:24: error: io.positioner.command.address: must be a number (got text in "
        "quotes, '30011'). 30011 is input register 10 counted from 0, which can't be written\n");
  CHECK(said_of_loop(with(kModbusLoop, "type: f32}",
                          "type: f32}\n    status: {table: input, address: 400005, mask: 1}"))
            .find("400005 is holding register 4 counted from 0") != std::string::npos);
}

TEST_CASE("An ambiguous address is taken literally, with a warning", "[config][modbus]") {
  const std::string decimal = with(kModbusLoop, "address: 100", "address: 40201");
  CHECK(read(decimal).command.reg.address == 40201);
  CHECK(said_of_loop(decimal) ==
        "loop.yaml:25:24: warning: io.positioner.command.address: is used as written, but looks "
        "like a number from a manual. 40201 is holding register 200 counted from 0: write `table: "
        "holding`, `address: 200`. If 40201 counted from 0 is meant, write 0x9D09\n");
  const std::string hexadecimal = with(kModbusLoop, "address: 100", "address: 0x9D09");
  CHECK(read(hexadecimal).command.reg.address == 40201);
  CHECK(said_of_loop(hexadecimal).empty());
  // SunSpec's maps begin at 40000, and no manual has a register 0.
  CHECK(said_of_loop(with(kModbusLoop, "address: 100", "address: 40000")).empty());
  CHECK(said_of_loop(with(kModbusLoop, "address: 100", "address: 50201")).empty());
  CHECK(said_of_loop(with(kModbusLoop, "address: 100", "address: 4020")).empty());
}

TEST_CASE("PV is read at least once in its greatest age", "[config][modbus]") {
  CHECK(said_of_loop(
            with(kModbusLoop, "backend: modbus\n", "backend: modbus\n  poll_period: 0.4\n")) ==
        "loop.yaml:18:16: error: io.poll_period: must be at most max_age = 0.3 s (at "
        "3:19), or PV is stale between two polls (got 0.4)\n");
}

TEST_CASE("A command must outlive a period of the loop", "[config][modbus]") {
  CHECK(said_of_loop(
            with(kModbusLoop, "backend: modbus\n", "backend: modbus\n  max_command_age: 0.1\n")) ==
        "loop.yaml:18:20: error: io.max_command_age: must be longer than sample_time = 0.1 s (at "
        "2:14) "
        "(got 0.1)\n");
  CHECK(read(with(kModbusLoop, "backend: modbus\n", "backend: modbus\n  max_command_age: 0.5\n"))
            .max_command_age_ns == 500'000'000);
  CHECK(read(with(kModbusLoop, "backend: modbus\n", "backend: modbus\n  poll_period: 0.05\n"))
            .poll_period_ns == 50'000'000);
}

}  // namespace modbus_reader_test
