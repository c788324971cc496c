// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_source.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <type_traits>

#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_loop_io.hpp"
#include "tests/hal/modbus/modbus_rig.hpp"

namespace modbus_source_test {

using namespace loopwarden;
using namespace loopwarden::test;
using mb::RegisterType;

namespace {

// A type without commands can't be given one.
static_assert(!std::is_convertible_v<mb::ReadTask&, mb::LinkTask&>);
static_assert(!std::is_base_of_v<mb::LinkTask, mb::ReadTask>);
static_assert(!std::is_convertible_v<mb::ReadLink&, mb::ModbusLink&>);
static_assert(!std::is_base_of_v<hal::LoopIo, mb::ModbusSource>);

mb::SourcePoint at(const mb::LinkSettings& link, std::uint16_t address, RegisterType type,
                   mb::Table table = mb::Table::input_register) {
  mb::PointSettings point = input(address, type);
  point.reg.table = table;
  return {.link = link, .point = point};
}

// Every table, so that every read function is used.
mb::ModbusSourceSettings source_on(const mb::LinkSettings& link, mb::Table mode) {
  mb::ModbusSourceSettings source;
  source.process_variable = at(link, 0, RegisterType::f32);
  source.output = at(link, 2, RegisterType::f32, mb::Table::holding_register);
  source.set_point = at(link, 4, RegisterType::f32);
  source.stem = at(link, 6, RegisterType::f32);
  source.mode = at(link, mb::is_bit(mode) ? 0 : 8, RegisterType::u16, mode);
  source.mode_values = {.automatic = {1.0}, .manual = {0.0}};
  source.poll_period_ns = 20'000'000;
  return source;
}

bool all_good(mb::ModbusSource& source, hal::SourceInputs& inputs) {
  source.read(inputs);
  const auto good = [](const hal::SourceSample& s) {
    return s.sample.quality == hal::Quality::good;
  };
  return good(inputs.process_variable) && good(inputs.output) && good(inputs.set_point) &&
         good(inputs.stem) && good(inputs.mode);
}

}  // namespace

TEST_CASE("a PLC that controls by itself is read only by functions 1 to 4", "[modbus][source]") {
  TcpRig rig({}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSource by_coil(source_on(rig.link(), mb::Table::coil), "FIC-1", bus);
  mb::ModbusSource by_input(source_on(rig.link(), mb::Table::discrete_input), "FIC-2", bus);
  by_coil.open();
  by_input.open();
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(by_coil, inputs); }));
  CHECK(inputs.process_variable.sample.value == Approx(20.0).margin(0.5));
  CHECK(inputs.output.sample.value == Approx(50.0).margin(2.0));
  CHECK(inputs.set_point.sample.value == 20.0);
  CHECK(inputs.mode.sample.value == 1.0);
  CHECK(inputs.process_variable.alive_ns == inputs.process_variable.sample.time_ns);
  REQUIRE(eventually([&] { return all_good(by_input, inputs); }));
  rig.device.command("mode 0");
  REQUIRE(
      eventually([&] { return all_good(by_input, inputs) && inputs.mode.sample.value == 0.0; }));

  // Lost and found again: a new connection doesn't write either.
  rig.device.command("restart 0.1");
  REQUIRE(eventually([&] { return !all_good(by_coil, inputs); }));
  REQUIRE(eventually([&] { return all_good(by_coil, inputs) && all_good(by_input, inputs); }));
  CHECK(by_coil.counters().connected);
  CHECK(by_coil.counters().writes == 0);
  CHECK(ForeignProcess::field(rig.device.command("state"), "functions") == "1,2,3,4");
  by_coil.close();
  by_input.close();
}

// Returns the requests that the device got per period of the source.
template <class Rig>
double requests_a_period(Rig& rig, mb::ModbusSource& source) {
  hal::SourceInputs inputs;
  const auto requests = [&] {
    return std::stod(ForeignProcess::field(rig.device.command("state"), "requests"));
  };
  REQUIRE(eventually([&] { return all_good(source, inputs); }));
  const auto period = inputs.process_variable.sample.sequence;
  const double before = requests();
  REQUIRE(eventually([&] {
    source.read(inputs);
    return inputs.process_variable.sample.sequence > period + 40;
  }));
  const double after = requests();
  source.read(inputs);
  return (after - before) / static_cast<double>(inputs.process_variable.sample.sequence - period);
}

mb::ModbusSourceSettings all_input_registers(const mb::LinkSettings& link) {
  mb::ModbusSourceSettings source = source_on(link, mb::Table::input_register);
  source.output = at(link, 2, RegisterType::f32);
  return source;
}

TEST_CASE("one request reads neighbouring registers", "[modbus][source]") {
  TcpRig rig({}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSource source(all_input_registers(rig.link()), "FIC-1", bus);
  source.open();
  CHECK(requests_a_period(rig, source) < 1.5);
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(source, inputs); }));
  CHECK(inputs.process_variable.sample.value == Approx(20.0).margin(0.5));
  CHECK(inputs.output.sample.value == Approx(50.0).margin(2.0));
  CHECK(inputs.set_point.sample.value == 20.0);
  CHECK(inputs.stem.sample.value == inputs.output.sample.value);
  CHECK(inputs.mode.sample.value == 1.0);
  source.close();
}

TEST_CASE("on a serial line one request reads neighbouring registers", "[modbus][source]") {
  SerialRig rig({}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSource source(all_input_registers(rig.link()), "FIC-1", bus);
  mb::ModbusSourceSettings apart = all_input_registers(rig.link());
  for (mb::SourcePoint* point :
       {&apart.process_variable, &apart.output, &*apart.set_point, &*apart.stem, &*apart.mode}) {
    point->point.reg.table = mb::Table::holding_register;
  }
  mb::ModbusSource other(apart, "FIC-2", bus);
  source.open();
  other.open();
  CHECK(requests_a_period(rig, source) < 2.5);  // one a table
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(source, inputs); }));
  CHECK(inputs.set_point.sample.value == 20.0);
  CHECK(inputs.mode.sample.value == 1.0);

  // Interrupted and found again, with a reply to the older request on its way.
  const auto seen = inputs.process_variable.sample.sequence;
  rig.proxy.command("late 700");
  REQUIRE(eventually([&] { return !all_good(source, inputs); }));
  rig.proxy.command("ok");
  REQUIRE(eventually([&] { return all_good(source, inputs) && all_good(other, inputs); }));
  CHECK(inputs.set_point.sample.value == 20.0);
  CHECK(inputs.process_variable.sample.sequence > 0);
  REQUIRE(eventually(
      [&] { return all_good(source, inputs) && inputs.process_variable.sample.sequence > seen; }));
  other.close();
  source.close();
}

TEST_CASE("one request serves loops that were opened at different times", "[modbus][source]") {
  TcpRig rig({}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSourceSettings settings = all_input_registers(rig.link());
  settings.poll_period_ns = 100'000'000;
  mb::ModbusSource first(settings, "FIC-1", bus);
  mb::ModbusSource second(settings, "FIC-2", bus);
  first.open();
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(first, inputs); }));
  // Half a period after the first one's newest read.
  const std::int64_t at_ns = inputs.process_variable.sample.time_ns + 150'000'000;
  REQUIRE(eventually([&] { return mb::BusWaiter::now_ns() >= at_ns; }));
  second.open();
  REQUIRE(eventually([&] { return all_good(second, inputs); }));
  CHECK(requests_a_period(rig, first) < 1.5);
  second.close();
  first.close();
}

TEST_CASE("a gap that a device refuses splits a request in two", "[modbus][source]") {
  TcpRig rig({"--absent", "9"}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSourceSettings settings = all_input_registers(rig.link());
  settings.mode->point.reg.address = 12;  // 0 there: manual
  mb::ModbusSource source(settings, "FIC-1", bus);
  source.open();
  CHECK(requests_a_period(rig, source) == Approx(2.0).margin(0.4));
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(source, inputs); }));
  CHECK(inputs.set_point.sample.value == 20.0);
  CHECK(inputs.mode.sample.value == 0.0);
  source.close();
}

TEST_CASE("one address that a device does not have is requested separately from the others",
          "[modbus][source]") {
  TcpRig rig({"--absent", "4", "5"}, "plc_device.py");  // SP
  mb::ModbusBus bus;
  mb::ModbusSource source(all_input_registers(rig.link()), "FIC-1", bus);
  mb::ModbusSourceSettings without = all_input_registers(rig.link());
  without.set_point = at(rig.link(), 12, RegisterType::f32);
  mb::ModbusSource other(without, "FIC-2", bus);
  source.open();
  other.open();
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(other, inputs); }));
  // PV and CO of both, SP, and the registers after it.
  CHECK(requests_a_period(rig, other) < 4.0);
  source.read(inputs);
  CHECK(inputs.set_point.sample.reason == hal::Reason::device_error);
  CHECK(inputs.process_variable.sample.quality == hal::Quality::good);
  CHECK(inputs.mode.sample.quality == hal::Quality::good);
  other.close();
  source.close();
}

TEST_CASE("one value that a device refuses or does not answer makes no other one bad",
          "[modbus][source]") {
  // The device answers with exceptions of any code, or not at all.
  for (const char* code : {"1", "3", "4", "6", "11", "244", "0"}) {
    CAPTURE(code);
    TcpRig rig({"--absent", "4", "5", "--absent-code", code}, "plc_device.py");  // SP
    mb::ModbusBus bus;
    mb::ModbusSource source(all_input_registers(rig.link()), "FIC-1", bus);
    source.open();
    hal::SourceInputs inputs;
    const auto good = [&] {
      source.read(inputs);
      return inputs.process_variable.sample.quality == hal::Quality::good &&
             inputs.output.sample.quality == hal::Quality::good &&
             inputs.stem.sample.quality == hal::Quality::good &&
             inputs.mode.sample.quality == hal::Quality::good;
    };
    REQUIRE(eventually(good));
    const auto seen = inputs.mode.sample.sequence;
    CHECK(eventually([&] { return good() && inputs.mode.sample.sequence > seen + 10; }));
    CHECK(inputs.set_point.sample.quality == hal::Quality::bad);
    source.close();
  }
}

TEST_CASE("a gap that a device does not answer, or not with exception 2, splits a request too",
          "[modbus][source]") {
  for (const char* code : {"4", "0"}) {
    CAPTURE(code);
    TcpRig rig({"--absent", "9", "--absent-code", code}, "plc_device.py");
    mb::ModbusBus bus;
    mb::ModbusSourceSettings settings = all_input_registers(rig.link());
    settings.mode->point.reg.address = 12;
    mb::ModbusSource source(settings, "FIC-1", bus);
    source.open();
    hal::SourceInputs inputs;
    REQUIRE(eventually([&] { return all_good(source, inputs); }));
    CHECK(inputs.mode.sample.value == 0.0);
    const auto seen = inputs.mode.sample.sequence;
    CHECK(eventually(
        [&] { return all_good(source, inputs) && inputs.mode.sample.sequence > seen + 10; }));
    CHECK(requests_a_period(rig, source) == Approx(2.0).margin(0.4));
    source.close();
  }
}

TEST_CASE(
    "units of a gateway share its connections, and one that is silent delays no other for long",
    "[modbus][source]") {
  TcpRig rig({"--units", "1,2,3"}, "plc_device.py");
  mb::LinkSettings link = rig.link();
  link.connections = 1;
  mb::ModbusBus bus;
  const auto of_unit = [&](std::uint8_t unit) {
    mb::ModbusSourceSettings settings = all_input_registers(link);
    for (mb::SourcePoint* point : {&settings.process_variable, &settings.output,
                                   &*settings.set_point, &*settings.stem, &*settings.mode}) {
      point->point.unit = unit;
    }
    return settings;
  };
  mb::ModbusSource first(of_unit(1), "FIC-1", bus);
  mb::ModbusSource silent(of_unit(9), "FIC-9", bus);
  mb::ModbusSource last(of_unit(3), "FIC-3", bus);
  CHECK(bus.link(link, 1) == bus.link(link, 3));
  first.open();
  silent.open();
  last.open();
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(first, inputs); }));
  REQUIRE(eventually([&] { return all_good(last, inputs); }));
  const auto seen = inputs.process_variable.sample.sequence;
  REQUIRE(eventually([&] {
    return all_good(last, inputs) && inputs.process_variable.sample.sequence > seen + 50;
  }));
  CHECK_FALSE(silent.counters().connected);
  CHECK(first.counters().connected);
  // As often as in probe_interval, not with each period of 20 ms.
  CHECK(silent.counters().timeouts < 20);

  link.connections = 2;
  mb::ModbusBus two;
  const auto one = two.link(link, 1);
  CHECK(two.link(link, 2) != one);
  CHECK(two.link(link, 5) == one);  // the third unit
  CHECK(two.link(link, 1) == one);
  last.close();
  silent.close();
  first.close();
}

TEST_CASE("on a serial line a loop is watched while the commands of another continue",
          "[modbus][source]") {
  SerialRig rig({"--units", "1,2"}, "plc_device.py");
  mb::ModbusBus bus;
  mb::ModbusSource source(source_on(rig.link(), mb::Table::coil), "FIC-1", bus);
  source.open();
  hal::SourceInputs inputs;
  REQUIRE(eventually([&] { return all_good(source, inputs); }));
  CHECK(inputs.stem.sample.value == Approx(50.0).margin(2.0));
  CHECK(inputs.mode.sample.value == 1.0);
  CHECK(ForeignProcess::field(rig.device.command("state"), "functions") == "1,3,4");

  mb::LoopModbusSettings loop;
  loop.transmitter_link = loop.positioner_link = rig.link();
  loop.process_variable = input(0, RegisterType::f32);
  loop.process_variable.unit = loop.command.unit = 2;
  loop.command.reg = {.table = mb::Table::holding_register, .type = RegisterType::f32};
  loop.output = {.low = 0.0, .high = 10.0};
  loop.poll_period_ns = 20'000'000;
  loop.max_command_age_ns = 10'000'000'000;
  mb::ModbusLoopIo io(loop, "FIC-2", bus);
  io.open();
  std::string why;
  CHECK(io.drive(5.0, std::chrono::milliseconds(10'000), why));
  CHECK(why.empty());
  CHECK(io.counters().writes > 0);
  CHECK(source.counters().writes == 0);
  const auto seen = inputs.process_variable.sample.sequence;
  REQUIRE(eventually(
      [&] { return all_good(source, inputs) && inputs.process_variable.sample.sequence > seen; }));
  io.close();
  source.close();
}

}  // namespace modbus_source_test
