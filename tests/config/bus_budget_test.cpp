// SPDX-License-Identifier: Apache-2.0
#include "config/bus_budget.hpp"

#include <catch2/catch.hpp>

#include "hal/modbus/line_time.hpp"

namespace bus_budget_test {

using namespace loopwarden;
using namespace loopwarden::config;
using namespace loopwarden::hal::modbus;

namespace {

LinkSettings line(int baud) {
  LinkSettings link;
  link.name = "line";
  link.transport = Transport::rtu;
  link.baud = baud;
  return link;
}

LoopModbusSettings loop_on(const LinkSettings& link) {
  LoopModbusSettings loop;
  loop.transmitter_link = link;
  loop.positioner_link = link;
  loop.process_variable.reg.type = RegisterType::f32;
  return loop;
}

}  // namespace

TEST_CASE("A transaction costs its bytes, its silences and the device's turnaround",
          "[config][bus]") {
  const LinkSettings slow = line(9600);
  LoopModbusSettings loop = loop_on(slow);
  const double byte_s = 11.0 / 9600.0;
  // Read of two registers: 8 + 9 bytes. Write of one by function 16: 11 + 8 bytes.
  const double around_s = 2 * 3.5 * byte_s + 0.005;
  CHECK(line_time_s(loop, slow) == Approx(17 * byte_s + around_s + 19 * byte_s + around_s));
  // By function 6: 8 + 8 bytes.
  loop.command.reg.write_function = WriteFunction::single;
  CHECK(line_time_s(loop, slow) == Approx(17 * byte_s + around_s + 16 * byte_s + around_s));
}

TEST_CASE("Every transaction counts, on its own line only", "[config][bus]") {
  const LinkSettings here = line(19200);
  LinkSettings elsewhere = here;
  elsewhere.name = "other";
  LoopModbusSettings loop = loop_on(here);
  const double before_s = line_time_s(loop, here);
  loop.process_variable.status = StatusRegister{};
  const double with_status_s = line_time_s(loop, here);
  CHECK(with_status_s > before_s);
  loop.read_back = PointSettings{};
  CHECK(line_time_s(loop, here) > with_status_s);
  CHECK(line_time_s(loop, elsewhere) == 0.0);
  loop.positioner_link = elsewhere;
  CHECK(line_time_s(loop, here) + line_time_s(loop, elsewhere) > with_status_s);
  CHECK(line_time_s(loop, here) < with_status_s);
}

TEST_CASE("Above 19200 baud the silence stays at 1.75 ms; the pause of the link counts",
          "[config][bus]") {
  LinkSettings fast = line(115200);
  LoopModbusSettings loop = loop_on(fast);
  loop.positioner_link.name = "other";
  CHECK(line_time_s(loop, fast) == Approx(17 * 11.0 / 115200.0 + 2 * 0.00175 + 0.005));
  fast.pause_ms = 20;
  CHECK(line_time_s(loop, fast) == Approx(17 * 11.0 / 115200.0 + 2 * 0.00175 + 0.005 + 0.020));
}

TEST_CASE("The load of a line is the sum over its loops", "[config][bus]") {
  const LinkSettings link = line(9600);
  LoopConfig a;
  a.name = "FIC-1";
  LoopModbusSettings io = loop_on(link);
  io.poll_period_ns = 200'000'000;
  a.io = io;
  LoopConfig b = a;
  b.name = "FIC-2";
  io.poll_period_ns = 400'000'000;
  b.io = io;
  LoopConfig simulated;
  simulated.name = "FIC-3";
  const BusLoad load = bus_load({a, b, simulated}, link);
  const double time_s = line_time_s(io, link);
  CHECK(load.share == Approx(time_s / 0.2 + time_s / 0.4));
  CHECK(load.details == "FIC-1 67 ms of 200 ms, FIC-2 67 ms of 400 ms");
}

TEST_CASE("Values of watched loops count as they are requested together", "[config][bus][watch]") {
  const LinkSettings link = line(19200);
  const auto at = [&](int address) {
    SourcePoint point;
    point.link = link;
    point.point.reg = {.table = Table::input_register,
                       .address = static_cast<std::uint16_t>(address),
                       .type = RegisterType::f32};
    return point;
  };
  const auto watched = [&](const std::string& name, int address) {
    LoopConfig loop;
    loop.name = name;
    ModbusSourceSettings io;
    io.process_variable = at(address);
    io.output = at(address + 2);
    loop.io = io;
    return loop;
  };
  const LoopConfig a = watched("FIC-1", 0);
  const LoopConfig b = watched("FIC-2", 10);   // after a gap of six
  const LoopConfig c = watched("FIC-3", 100);  // too far away
  const BusLoad load = bus_load({c, b, a}, link);
  CHECK(load.share == Approx(read_s(link, 14) + read_s(link, 4)));
  CHECK(load.details.find("watched loops") == 0);
  CHECK(load.details.find("(2 requests)") != std::string::npos);

  // A loop that is controlled here waits for no read longer than a fifth of its period.
  LoopConfig here;
  here.name = "FIC-9";
  LoopModbusSettings io = loop_on(link);
  io.poll_period_ns = 150'000'000;
  here.io = io;
  const int most = most_registers_together(link, 0.15);
  CHECK(read_s(link, most) <= 0.03);
  CHECK(most < 14);
  const BusLoad beside = bus_load({a, b, here}, link);
  CHECK(beside.share == Approx(line_time_s(io, link) / 0.15 + 2.0 * read_s(link, 4)));
  CHECK(beside.details.find("FIC-9") < beside.details.find("watched loops"));
}

}  // namespace bus_budget_test
