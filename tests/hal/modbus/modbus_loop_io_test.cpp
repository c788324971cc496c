// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_loop_io.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>

#include "hal/modbus/modbus_bus.hpp"
#include "tests/hal/modbus/modbus_rig.hpp"

namespace modbus_loop_io_test {

using namespace loopwarden;
using namespace loopwarden::test;
using namespace std::chrono_literals;
using hal::Reason;
using mb::RegisterType;
using Kind = mb::LinkEvent::Kind;

namespace {

mb::PointSettings holding(std::uint16_t address, RegisterType type, double scale = 1.0) {
  mb::PointSettings point = input(address, type, mb::ByteOrder::abcd, scale);
  point.reg.table = mb::Table::holding_register;
  return point;
}

// PV, command and read-back on one device whose communication watchdog acts after 0.6 s. Commands
// stay valid for longer than a loaded host delays the thread that gives them.
mb::LoopModbusSettings loop_on(const mb::LinkSettings& link) {
  mb::LoopModbusSettings loop;
  loop.transmitter_link = link;
  loop.positioner_link = link;
  loop.process_variable = input(0, RegisterType::f32);
  loop.command = holding(0, RegisterType::f32);
  loop.read_back = input(20, RegisterType::f32);
  loop.output = {.low = 0.0, .high = 10.0, .resolution = 0.0};
  loop.comm_loss.protection = mb::CommLossProtection::watchdog_register;
  loop.comm_loss.watchdog = mb::WatchdogRegister{
      .point = holding(10, RegisterType::u16, 0.1), .value = 0.6, .check_interval_s = 1.0};
  loop.comm_loss.timeout_s = 0.6;
  loop.poll_period_ns = 20'000'000;
  loop.max_command_age_ns = 10'000'000'000;
  return loop;
}

// Acts as the real-time thread: reads and commands every 20 ms until stopped.
class LoopThread {
 public:
  LoopThread(mb::ModbusLoopIo& io, double output, bool write = true)
      : io_(io), output_(output), write_(write) {
    thread_ = std::thread([this] { run(); });
  }
  ~LoopThread() { stop(); }
  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void set(double output) { output_ = output; }
  void begin_to_write() { write_ = true; }
  bool output_ok() const { return output_ok_; }
  Reason output_reason() const { return output_reason_; }
  bool pv_good() const { return pv_good_; }
  double pv() const { return pv_; }
  double valve_position() const { return valve_position_; }
  std::uint64_t fresh_samples() const { return fresh_samples_; }

 private:
  void run() {
    std::uint32_t last = 0;
    while (!stopping_) {
      hal::CycleTime time;
      time.now_ns = mb::BusWaiter::now_ns();
      hal::Inputs inputs;
      io_.read(time, inputs);
      output_ok_ = inputs.output_ok;
      output_reason_ = inputs.output_reason;
      pv_good_ = inputs.process_variable.quality == hal::Quality::good;
      pv_ = inputs.process_variable.value;
      valve_position_ = inputs.valve_position.value;
      if (pv_good_ && inputs.process_variable.sequence != last) fresh_samples_ = fresh_samples_ + 1;
      last = inputs.process_variable.sequence;
      io_.write(time, {.output = output_, .time_ns = time.now_ns, .write = write_, .alarm = false});
      std::this_thread::sleep_for(20ms);
    }
  }

  mb::ModbusLoopIo& io_;
  std::atomic<bool> stopping_{false};
  std::atomic<double> output_;
  std::atomic<bool> write_{true};
  std::atomic<bool> output_ok_{false};
  std::atomic<Reason> output_reason_{Reason::never_received};
  std::atomic<bool> pv_good_{false};
  std::atomic<double> pv_{0.0};
  std::atomic<double> valve_position_{0.0};
  std::atomic<std::uint64_t> fresh_samples_{0};
  std::thread thread_;
};

void check_reads_and_commands(const mb::LinkSettings& link, ForeignProcess& device) {
  mb::ModbusBus bus;
  mb::ModbusLoopIo io(loop_on(link), "loop", bus);
  io.open();
  LoopThread loop(io, 4.0);
  REQUIRE(eventually([&] { return loop.output_ok() && loop.pv_good(); }));
  CHECK(device.state_number("co") == Approx(4.0));
  // The plant answers: PV = 1.2264 CO in the end, and the stem follows.
  CHECK(eventually([&] { return loop.valve_position() == Approx(4.0).margin(0.01); }));
  CHECK(eventually([&] { return loop.pv() == Approx(4.9056).margin(0.05); }));
  CHECK(device.state_number("unguarded_writes") == 0);
  CHECK(io.counters().writes > 0);
  CHECK(io.counters().connected);
}

}  // namespace

TEST_CASE("TCP: a loop reads its transmitter and moves its valve", "[modbus][loop_io]") {
  TcpRig rig({"--speed", "20"});
  check_reads_and_commands(rig.link(), rig.device);
}

TEST_CASE("RTU: a loop reads its transmitter and moves its valve", "[modbus][loop_io]") {
  SerialRig rig({"--speed", "20"});
  check_reads_and_commands(rig.link(), rig.device);
}

TEST_CASE("write returns the output stage's value of a command", "[modbus][loop_io]") {
  mb::ModbusBus bus;
  const hal::CycleTime time;
  const auto output = [&](const mb::LoopModbusSettings& settings, double value) {
    mb::ModbusLoopIo io(settings, "loop", bus);
    return io.write(time, {.output = value, .time_ns = 0, .write = false, .alarm = false});
  };
  mb::LoopModbusSettings loop = loop_on(tcp_link("1502"));
  CHECK(output(loop, 4.25) == 4.25);
  CHECK(output(loop, 11.0) == 10.0);
  CHECK(output(loop, -1.0) == 0.0);
  loop.output = {.low = 1.0, .high = 9.0, .resolution = 0.5};
  CHECK(output(loop, 4.3) == Approx(4.5));
  CHECK(output(loop, 0.0) == Approx(1.0));
  CHECK(output(loop, 20.0) == Approx(9.0));
  loop.output.resolution = 0.0;
  loop.command = holding(2, RegisterType::u16, 0.01);
  CHECK(output(loop, 4.256) == Approx(4.26));
}

TEST_CASE("a value that is no number is never sent", "[modbus][loop_io]") {
  mb::ModbusBus bus;
  mb::ModbusLoopIo io(loop_on(tcp_link("1502")), "loop", bus);
  const hal::CycleTime time;
  io.write(time, {.output = 3.0, .time_ns = 0, .write = true, .alarm = false});
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CHECK(io.write(time, {.output = value, .time_ns = 0, .write = true, .alarm = false}) == 3.0);
  }
}

TEST_CASE("before the first command the device and its watchdog register are not written",
          "[modbus][loop_io]") {
  TcpRig rig({"--start", "3", "--fail-safe", "1.5"});
  mb::ModbusBus bus;
  mb::LoopModbusSettings settings = loop_on(rig.link());
  settings.read_back.reset();
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  LoopThread loop(io, 6.0, false);
  // Also over a reconnection, after which a device's watchdog is otherwise set again.
  for (int times = 0; times < 2; ++times) {
    const std::uint64_t seen = loop.fresh_samples();
    REQUIRE(eventually([&] { return loop.fresh_samples() > seen + 10; }));
    CHECK(rig.device.state("writes") == "0");
    CHECK(rig.device.state("watchdog_register") == "0");
    CHECK(rig.device.state_number("co") == (times == 0 ? 3.0 : 1.5));
    CHECK_FALSE(loop.output_ok());
    CHECK(loop.output_reason() == Reason::never_received);
    rig.device.command("restart 0.1");
  }
  loop.begin_to_write();
  CHECK(eventually([&] { return rig.device.state_number("co") == 6.0 && loop.output_ok(); }));
  CHECK(rig.device.state("watchdog_register") == "6");
  CHECK(rig.device.state("unguarded_writes") == "0");
}

TEST_CASE("a loop that hangs leaves its valve to the device's watchdog", "[modbus][loop_io]") {
  TcpRig rig({"--fail-safe", "1.5"});
  Events events;
  mb::ModbusBus bus(events.sink());
  mb::LoopModbusSettings settings = loop_on(rig.link());
  settings.max_command_age_ns = 1'000'000'000;
  settings.comm_loss.timeout_s = settings.comm_loss.watchdog->value = 2.0;
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  {
    LoopThread loop(io, 6.0);
    REQUIRE(eventually([&] { return rig.device.state_number("co") == 6.0; }));
    // Fed by every poll of 20 ms, the watchdog stays quiet for longer than its time.
    const double writes = rig.device.state_number("writes");
    REQUIRE(eventually([&] { return rig.device.state_number("writes") > writes + 110; }));
    CHECK(rig.device.state("watchdog") == "ok");
  }
  REQUIRE(eventually([&] { return rig.device.state("watchdog") == "tripped"; }));
  CHECK(rig.device.state_number("co") == 1.5);
  CHECK(io.counters().old_commands_withheld > 0);
  CHECK(events.count(Kind::commands_withheld) == 1);
  hal::Inputs inputs;
  io.read({}, inputs);
  CHECK_FALSE(inputs.output_ok);
  CHECK(inputs.output_reason == Reason::stale);

  LoopThread loop(io, 5.0);
  CHECK(eventually([&] { return rig.device.state_number("co") == 5.0 && loop.output_ok(); }));
}

TEST_CASE(
    "a bus that is busy with something else: the output counts as lost before the device acts",
    "[modbus][loop_io]") {
  TcpRig rig;
  mb::ModbusBus bus;
  mb::LoopModbusSettings settings = loop_on(rig.link());
  settings.max_command_age_ns = 60'000'000'000;
  settings.comm_loss.timeout_s = 10.0;  // longer than a loaded host delays the bus thread
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  {
    LoopThread loop(io, 4.0);
    REQUIRE(eventually([&] { return loop.output_ok(); }));
  }
  // Simulates a bus thread that has not run since.
  const auto inputs_after = [&](std::int64_t wait_ns) {
    hal::Inputs inputs;
    io.read({.now_ns = mb::BusWaiter::now_ns() + wait_ns, .period_index = 0}, inputs);
    return inputs;
  };
  CHECK(inputs_after(0).output_ok);
  const std::int64_t silence_ns = mb::longest_silence_ns(settings);
  CHECK_FALSE(inputs_after(silence_ns + 1'000'000).output_ok);
  CHECK(inputs_after(silence_ns + 1'000'000).output_reason == Reason::link_lost);

  // The loop does not know the output any more and requests no write.
  const auto command = [&](bool write) {
    io.write({},
             {.output = 4.5, .time_ns = mb::BusWaiter::now_ns(), .write = write, .alarm = true});
  };
  command(false);
  CHECK_FALSE(inputs_after(0).output_ok);
  CHECK(inputs_after(0).output_reason == Reason::link_lost);
  command(true);
  CHECK(eventually([&] { return inputs_after(0).output_ok; }));
  CHECK(rig.device.state_number("co") == 4.5);
}

TEST_CASE("the longest time without commands: until the device acts, less one exchange",
          "[modbus][loop_io]") {
  mb::LoopModbusSettings loop;
  loop.positioner_link.response_timeout_ms = 150;
  loop.poll_period_ns = 100'000'000;
  loop.comm_loss.protection = mb::CommLossProtection::set_by_device;
  loop.comm_loss.timeout_s = 1.0;
  CHECK(mb::longest_silence_ns(loop) == 750'000'000);
  loop.comm_loss.timeout_s = 0.4;  // shorter than sound
  CHECK(mb::longest_silence_ns(loop) == 250'000'000);
  loop.comm_loss.protection = mb::CommLossProtection::none_accepted;
  CHECK(mb::longest_silence_ns(loop) == 700'000'000);
}

TEST_CASE("a pulled cable: the device applies its fail-safe value", "[modbus][loop_io]") {
  TcpRig rig({"--fail-safe", "2.5"});
  mb::ModbusBus bus;
  mb::ModbusLoopIo io(loop_on(rig.link()), "loop", bus);
  io.open();
  LoopThread loop(io, 6.0);
  for (const char* fault : {"silent", "down"}) {
    CAPTURE(fault);
    REQUIRE(eventually([&] { return rig.device.state_number("co") == 6.0 && loop.output_ok(); }));
    if (std::string(fault) == "silent") {
      rig.proxy.freeze();  // no message passes in either direction
    } else {
      rig.proxy.command(fault);
    }
    REQUIRE(eventually([&] { return !loop.output_ok() && !loop.pv_good(); }));
    CHECK(loop.output_reason() == Reason::link_lost);
    REQUIRE(eventually([&] { return rig.device.state("watchdog") == "tripped"; }));
    CHECK(rig.device.state_number("co") == 2.5);
    rig.proxy.thaw();
    rig.proxy.command("up");
  }
  REQUIRE(eventually([&] { return loop.output_ok() && loop.pv_good(); }));
  CHECK(io.counters().write_errors > 0);
}

namespace {

// Restarts the device while a loop runs: no command may come before its watchdog is set again.
void check_restarts(const mb::LinkSettings& link, ForeignProcess& device) {
  Events events;
  mb::ModbusBus bus(events.sink());
  mb::LoopModbusSettings settings = loop_on(link);
  // detected by the failure, not by a check
  settings.comm_loss.watchdog->check_interval_s = 1000.0;
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  LoopThread loop(io, 6.0);
  for (int restarts = 1; restarts <= 3; ++restarts) {
    REQUIRE(eventually([&] { return device.state_number("co") == 6.0; }));
    CHECK(device.state_number("watchdog_register") == 6);  // tenths of a second
    device.command("restart 0.4");
    REQUIRE(eventually([&] { return events.count(Kind::watchdog_set) > restarts; }));
  }
  REQUIRE(eventually([&] { return device.state_number("co") == 6.0; }));
  CHECK(device.state_number("unguarded_writes") == 0);
  CHECK(device.state_number("restarts") == 3);
}

}  // namespace

TEST_CASE("TCP: after a restart the device's watchdog is set before any command",
          "[modbus][loop_io]") {
  TcpRig rig;
  SECTION("straight") { check_restarts(tcp_link(rig.device.ready("port")), rig.device); }
  SECTION("after a gateway that stays up") { check_restarts(rig.link(), rig.device); }
}

TEST_CASE("RTU: after a restart the device's watchdog is set before any command",
          "[modbus][loop_io]") {
  SerialRig rig;
  check_restarts(rig.link(), rig.device);
}

TEST_CASE("a restart that no request noticed is found by the lost watchdog", "[modbus][loop_io]") {
  SerialRig rig;
  Events events;
  mb::ModbusBus bus(events.sink());
  // A request without an answer in time would also set the watchdog.
  mb::LinkSettings link = rig.link();
  link.response_timeout_ms = 2000;
  mb::LoopModbusSettings settings = loop_on(link);
  settings.comm_loss.timeout_s = settings.comm_loss.watchdog->value = 6.0;
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  LoopThread loop(io, 6.0);
  REQUIRE(eventually([&] { return rig.device.state_number("co") == 6.0; }));
  rig.device.command("forget");
  CHECK(eventually([&] { return events.count(Kind::watchdog_lost) == 1; }));
  CHECK(eventually([&] { return rig.device.state_number("watchdog_register") == 60; }));
}

TEST_CASE("without its device watchdog, a loop sends no command", "[modbus][loop_io]") {
  TcpRig rig({"--start", "3"});
  Events events;
  mb::ModbusBus bus(events.sink());
  mb::LoopModbusSettings settings = loop_on(rig.link());
  settings.comm_loss.watchdog->point.reg.address = 500;  // which the device does not have
  mb::ModbusLoopIo io(settings, "loop", bus);
  io.open();
  LoopThread loop(io, 6.0);
  REQUIRE(eventually([&] { return loop.output_reason() == Reason::device_error; }));
  REQUIRE(eventually([&] { return loop.pv_good(); }));
  CHECK_FALSE(loop.output_ok());
  CHECK(rig.device.state_number("writes") == 0);
  CHECK(rig.device.state_number("co") == 3.0);
  CHECK(events.count(Kind::watchdog_refused) == 1);
}

TEST_CASE("a command that is not to be written leaves the device alone", "[modbus][loop_io]") {
  TcpRig rig({"--start", "3"});
  mb::ModbusBus bus;
  mb::ModbusLoopIo io(loop_on(rig.link()), "loop", bus);
  io.open();
  hal::Inputs inputs;
  REQUIRE(eventually([&] {
    io.write({},
             {.output = 6.0, .time_ns = mb::BusWaiter::now_ns(), .write = false, .alarm = false});
    io.read({}, inputs);
    return inputs.process_variable.sequence > 10;
  }));
  CHECK(rig.device.state_number("writes") == 0);
  CHECK(rig.device.state_number("co") == 3.0);
}

TEST_CASE("drive puts the safe value on the device and waits for it", "[modbus][loop_io]") {
  TcpRig rig({"--start", "3"});
  mb::ModbusBus bus;
  std::string why;
  {
    mb::ModbusLoopIo io(loop_on(rig.link()), "loop", bus);
    CHECK_FALSE(io.drive(1.0, 100ms, why));  // not open
    io.open();
    REQUIRE(io.drive(1.25, 60s, why));
    CHECK(rig.device.state_number("co") == 1.25);
  }
  // The device keeps the command when the backend has closed.
  CHECK(rig.device.state_number("co") == 1.25);

  rig.proxy.command("down");
  mb::ModbusLoopIo io(loop_on(rig.link()), "loop", bus);
  io.open();
  CHECK_FALSE(io.drive(4.0, 300ms, why));
  CHECK(why.find("link lost") != std::string::npos);
}

TEST_CASE("drive does not wait for the end of a back-off", "[modbus][loop_io]") {
  TcpRig rig;
  mb::LoopModbusSettings settings = loop_on(rig.link());
  settings.transmitter_link.reconnect_min_s = settings.transmitter_link.reconnect_max_s = 600.0;
  settings.positioner_link = settings.transmitter_link;
  mb::ModbusBus bus;
  mb::ModbusLoopIo io(settings, "loop", bus);
  rig.proxy.command("down");
  io.open();
  std::string why;
  CHECK_FALSE(io.drive(4.0, 300ms, why));
  rig.proxy.command("up");
  CHECK(io.drive(4.0, 50s, why));  // less than the back-off
  CHECK(rig.device.state_number("co") == 4.0);
}

TEST_CASE("a dead device holds up no other loop, nor the loop's other device",
          "[modbus][loop_io]") {
  TcpRig alive;
  TcpRig dead;
  dead.proxy.command("silent");
  mb::ModbusBus bus;
  mb::LinkSettings dead_link = dead.link();
  dead_link.response_timeout_ms = 1000;
  mb::LoopModbusSettings half = loop_on(alive.link());
  half.transmitter_link = dead_link;
  mb::ModbusLoopIo dead_loop(loop_on(dead_link), "dead", bus);
  mb::ModbusLoopIo half_loop(half, "half", bus);
  mb::LoopModbusSettings other = loop_on(alive.link());
  other.process_variable = input(2, RegisterType::f32, mb::ByteOrder::cdab);
  mb::ModbusLoopIo alive_loop(other, "alive", bus);
  dead_loop.open();
  half_loop.open();
  alive_loop.open();
  LoopThread dead_thread(dead_loop, 1.0);
  LoopThread half_thread(half_loop, 2.0);
  LoopThread alive_thread(alive_loop, 2.0);
  REQUIRE(eventually([&] { return alive_thread.pv_good() && half_thread.output_ok(); }));

  const std::uint64_t before = alive_thread.fresh_samples();
  const std::uint64_t ticks = dead_loop.ticks();
  const std::uint64_t timeouts = dead_loop.counters().timeouts;
  // A thread that waited for the dead loop would have one sample per timeout.
  REQUIRE(eventually([&] { return alive_thread.fresh_samples() - before >= 50; }));
  CHECK(dead_loop.counters().timeouts - timeouts < 25);
  CHECK_FALSE(half_thread.pv_good());
  CHECK(half_thread.output_ok());
  CHECK_FALSE(dead_thread.output_ok());
  CHECK(eventually([&] { return dead_loop.ticks() > ticks; }));  // its bus thread is alive
  CHECK(eventually([&] { return dead_loop.counters().timeouts > 0; }));
}

TEST_CASE("loops on one serial line share a link", "[modbus][bus]") {
  SerialRig rig({"--units", "1,2"});
  mb::ModbusBus bus;
  const auto first = bus.link(rig.link(), 1);
  CHECK(bus.link(rig.link(), 2) == first);
  // With any name, and with the settings of the first: two masters on one line disturb each other.
  mb::LinkSettings other = rig.link();
  other.device = "/dev/../" + other.device;
  other.baud = 9600;
  CHECK(bus.link(other, 3) == first);
}

TEST_CASE("every unit on TCP has a separate link", "[modbus][bus]") {
  mb::ModbusBus bus;
  const mb::LinkSettings settings = tcp_link("1");
  const auto first = bus.link(settings, 1);
  CHECK(bus.link(settings, 1) == first);
  CHECK(bus.link(settings, 2) != first);
  mb::LinkSettings same = settings;
  same.host = "::ffff:" + settings.host;
  CHECK(bus.link(same, 1) == first);
}

}  // namespace modbus_loop_io_test
