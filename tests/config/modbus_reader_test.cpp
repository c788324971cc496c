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
  const auto loop = read_loop_text("loop.yaml", text, test::links());
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
  CHECK_FALSE(io.max_command_age_ns);
}

TEST_CASE("What happens when no command arrives must be stated", "[config][modbus]") {
  CHECK(
      said_of_loop(with(kModbusLoop, "    comm_loss: {timeout: 2, set_by: device}\n", "")) ==
      "loop.yaml:23:5: error: io.positioner: missing key 'comm_loss' ({timeout, register, value}, "
      "{timeout, set_by: device} or none_accepted). When the link is down, or this process is "
      "killed "
      "or stopped, only the device's own watchdog can bring the valve to a safe place: state which "
      "one does, or accept that none does\n");
  CHECK(said_of_loop(with_comm_loss("none")) ==
        "loop.yaml:26:16: error: io.positioner.comm_loss: must be {timeout, register, value}, "
        "{timeout, "
        "set_by: device} or none_accepted\n");

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

  CHECK(said_of_loop(with_comm_loss("{timeout: 2}")) ==
        "loop.yaml:26:16: error: missing key 'register' in 'io.positioner.comm_loss' (mapping)\n"
        "loop.yaml:26:16: error: missing key 'value' in 'io.positioner.comm_loss' (number)\n");
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

TEST_CASE("Registers that can't be are refused", "[config][modbus]") {
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

TEST_CASE("The command's register must hold what the loop may ask for", "[config][modbus]") {
  CHECK(said_of_loop(with(kModbusLoop, "scale: 0.001", "scale: 0.0001")) ==
        "loop.yaml:25:14: error: io.positioner.command: holds 0 to 6.5535 CO units by its "
        "type and scale, which does not cover the output range [0, 10] (at 9:28)\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "scale: 0.001", "scale: 1")) ==
      "loop.yaml:25:14: warning: io.positioner.command: its steps of 1 CO units are coarse for the "
      "output range [0, 10] (at 9:28)\n");
  CHECK(said_of_loop(with(kModbusLoop, "type: u16, scale: 0.001", "type: f32")).empty());
}

TEST_CASE("PV is asked for at least once in its greatest age", "[config][modbus]") {
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
