// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_link.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <string>
#include <thread>

#include "tests/hal/modbus/modbus_rig.hpp"

namespace modbus_link_test {

using namespace loopwarden;
using namespace loopwarden::test;
using namespace std::chrono_literals;
using hal::Reason;
using mb::ByteOrder;
using mb::RegisterType;
using Kind = mb::LinkEvent::Kind;

namespace {

std::uint64_t value(const mb::TaskCounters::Counter& counter) { return counter.load(); }

const std::vector<mb::PointSettings> kAllTypes{
    input(0, RegisterType::f32, ByteOrder::abcd),
    input(2, RegisterType::f32, ByteOrder::cdab),
    input(4, RegisterType::f32, ByteOrder::badc),
    input(6, RegisterType::f32, ByteOrder::dcba),
    input(8, RegisterType::f64, ByteOrder::abcd),
    input(12, RegisterType::u16, ByteOrder::abcd, 0.001),
    input(13, RegisterType::i16, ByteOrder::abcd, 0.001),
    input(14, RegisterType::u32, ByteOrder::abcd, 0.001),
    input(16, RegisterType::i32, ByteOrder::abcd, 0.001),
};

void check_all_types(mb::ModbusLink& link, ForeignProcess& device) {
  device.command("pv 7.25");
  Reader reader(link, kAllTypes);
  for (std::size_t i = 0; i < kAllTypes.size(); ++i) {
    CAPTURE(i);
    REQUIRE(eventually([&] { return reader.good(i) && reader.sample(i).value > 7.2; }));
    CHECK(reader.sample(i).value == Approx(7.25));
  }
  device.command("pv -1.5");
  for (const std::size_t i : {0UL, 4UL, 6UL, 8UL}) {
    CAPTURE(i);
    CHECK(eventually([&] { return reader.sample(i).value == Approx(-1.5); }));
  }
}

// Four tags of one unit, three of them in the same table and of the same size.
const std::vector<mb::PointSettings> kTags{
    input(40, RegisterType::u32),
    input(42, RegisterType::u32),
    input(44, RegisterType::u32),
    input(46, RegisterType::u32),
};

// Watches the tags for `duration`: no good sample may hold another register's value or an old one.
// Returns the number of good samples seen.
int watch_tags(Reader& reader, std::chrono::milliseconds duration,
               std::size_t tags = kTags.size()) {
  int seen = 0;
  std::vector<std::uint32_t> last(tags, 0);
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) {
    for (std::size_t i = 0; i < tags; ++i) {
      const hal::Sample sample = reader.sample(i);
      if (sample.quality != hal::Quality::good || sample.sequence == last[i]) continue;
      last[i] = sample.sequence;
      ++seen;
      const Tag tag(sample.value);
      CAPTURE(i, seen, tag.age_ms(sample.time_ns));
      REQUIRE(tag.register_number == 40 + 2 * i);
      REQUIRE(tag.age_ms(sample.time_ns) <= 2);  // taken after the request; rounded to ms
    }
    std::this_thread::sleep_for(2ms);
  }
  return seen;
}

}  // namespace

TEST_CASE("TCP: every type and byte order is read right", "[modbus][link]") {
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  check_all_types(link, rig.device);
}

TEST_CASE("RTU: every type and byte order is read right", "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  check_all_types(link, rig.device);
}

TEST_CASE("a device that is absent at start is found when it appears", "[modbus][link]") {
  TcpRig rig;
  rig.proxy.command("down");
  Events events;
  mb::ModbusLink link(rig.link(), events.sink());
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.sample().reason == Reason::link_lost; }));
  CHECK(reader.bad());
  REQUIRE(eventually([&] { return events.count(Kind::connect_failed) == 1; }));

  const std::uint64_t ticks = link.ticks();
  CHECK(eventually([&] { return link.ticks() > ticks + 3; }));  // alive while it waits

  rig.proxy.command("up");
  CHECK(eventually([&] { return reader.good(); }));
  CHECK(events.count(Kind::connect_failed) == 1);  // not once per attempt
  CHECK(events.count(Kind::connected) == 1);
}

TEST_CASE("a serial device file that is absent at start is no error", "[modbus][link]") {
  Events events;
  mb::ModbusLink link(rtu_link("/dev/does-not-exist"), events.sink());
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return events.count(Kind::connect_failed) == 1; }));
  REQUIRE(eventually([&] { return reader.sample().reason == Reason::link_lost; }));
}

TEST_CASE("TCP: bad during each fault, good after it", "[modbus][link]") {
  TcpRig rig;
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 1000;  // each fault costs one connection and has no other effect
  mb::ModbusLink link(settings, events.sink());
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(); }));

  for (const char* fault :
       {"late 4000", "truncate", "garbage", "wrong_unit", "wrong_number", "silent", "down"}) {
    CAPTURE(fault);
    rig.proxy.command(fault);
    REQUIRE(eventually([&] { return reader.bad(); }));
    CHECK(reader.sample().reason == Reason::link_lost);
    const auto ticks = link.ticks();
    REQUIRE(eventually([&] { return link.ticks() > ticks; }));
    reader.forget();
    rig.proxy.command("up");
    REQUIRE(eventually([&] { return reader.fresh(); }));
  }
  CHECK(value(reader.counters().timeouts) > 0);
  CHECK(value(reader.counters().invalid_replies) > 0);
  CHECK(link.reconnects() >= 7);
  CHECK(events.count(Kind::disconnected) == 7);
  CHECK(events.count(Kind::connected) == 8);
}

TEST_CASE("RTU: bad during each fault, good after it", "[modbus][link]") {
  SerialRig rig;
  Events events;
  mb::ModbusLink link(rig.link(), events.sink());
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(); }));

  for (const char* fault : {"late 400", "truncate", "garbage", "wrong_unit", "silent"}) {
    CAPTURE(fault);
    rig.proxy.command(fault);
    REQUIRE(eventually([&] { return reader.bad(); }));
    CHECK(reader.sample().reason == Reason::link_lost);
    reader.forget();
    rig.proxy.command("ok");
    REQUIRE(eventually([&] { return reader.fresh(); }));
  }
  CHECK(value(reader.counters().timeouts) > 0);
  CHECK(value(reader.counters().invalid_replies) > 0);
}

TEST_CASE("one spoiled reply costs TCP no more than a reconnection at once", "[modbus][link]") {
  TcpRig rig;
  mb::LinkSettings settings = rig.link();
  settings.reconnect_min_s = settings.reconnect_max_s = 600.0;  // back-off would be noticed
  mb::ModbusLink link(settings, {});
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(); }));
  for (const char* fault : {"garbage 1", "close", "truncate 1", "late 800 1"}) {
    CAPTURE(fault);
    const std::uint64_t reconnects = link.reconnects();
    rig.proxy.command(fault);
    REQUIRE(eventually([&] { return link.reconnects() > reconnects; }));
    reader.forget();
    // Sooner than the back-off would allow.
    REQUIRE(eventually([&] { return reader.fresh(); }, 50s));
  }
}

TEST_CASE("an exception makes the value bad, but the link is kept", "[modbus][link]") {
  TcpRig rig;
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink link(settings, events.sink());
  Reader reader(link, {input(0, RegisterType::f32), input(500, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(0); }));
  REQUIRE(eventually([&] { return reader.sample(1).reason == Reason::device_error; }));
  CHECK(reader.bad(1));
  reader.forget();
  CHECK(eventually([&] { return reader.fresh(0); }));
  CHECK(link.reconnects() == 0);
  CHECK(value(reader.counters().device_exceptions) > 0);
  CHECK(value(reader.counters().timeouts) == 0);
  CHECK(events.count(Kind::device_error) == 1);

  rig.proxy.command("exception 4");
  REQUIRE(eventually([&] { return reader.sample(0).reason == Reason::device_error; }));
  rig.proxy.command("ok");
  CHECK(eventually([&] { return reader.good(0); }));
}

TEST_CASE("a busy answer leaves the value as it was, and the request is repeated",
          "[modbus][link]") {
  TcpRig rig;
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink link(settings, events.sink());
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(); }));
  for (const char* code : {"5", "6", "10", "11", "244"}) {
    CAPTURE(code);
    const std::uint64_t refused = value(reader.counters().device_exceptions);
    rig.proxy.command("exception " + std::string(code) + " 1");
    REQUIRE(eventually([&] { return value(reader.counters().device_exceptions) > refused; }));
    CHECK(reader.good());
    reader.forget();
    REQUIRE(eventually([&] { return reader.fresh(); }));
  }
  CHECK_THAT(events.text(Kind::device_error),
             Catch::Contains("unit 1: exception 244 (") &&
                 Catch::Contains("reading input registers 0 to 1"));

  // Busy for long: the value ages, and its reader sees this.
  rig.proxy.command("exception 6");
  const std::uint64_t refused = value(reader.counters().device_exceptions);
  REQUIRE(eventually([&] { return value(reader.counters().device_exceptions) > refused + 20; }));
  CHECK(reader.good());
  CHECK(mb::BusWaiter::now_ns() - reader.sample().time_ns > 100'000'000);
  CHECK(link.reconnects() == 0);
}

TEST_CASE("one lost or spoiled reply leaves the value as it was", "[modbus][link]") {
  TcpRig tcp;
  SerialRig serial;
  mb::LinkSettings settings = tcp.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink tcp_link(settings, {});
  mb::ModbusLink serial_link(serial.link(), {});
  mb::PointSettings pv = input(0, RegisterType::f32);
  pv.max_age_ns = 60'000'000'000;
  Reader on_tcp(tcp_link, {pv});
  Reader on_serial(serial_link, {pv});
  const auto check = [](Reader& reader, ForeignProcess& proxy, const char* fault) {
    CAPTURE(fault);
    REQUIRE(eventually([&] { return reader.good(); }));
    const auto failures = [&] {
      return value(reader.counters().timeouts) + value(reader.counters().invalid_replies);
    };
    const std::uint64_t before = failures();
    proxy.command(fault);
    bool bad = false;
    REQUIRE(eventually([&] {
      bad = bad || reader.bad();
      return failures() > before;
    }));
    reader.forget();
    REQUIRE(eventually([&] {
      bad = bad || reader.bad();
      return reader.fresh();
    }));
    CHECK_FALSE(bad);
  };
  for (const char* fault : {"garbage 1", "truncate 1", "wrong_unit 1"}) {
    check(on_tcp, tcp.proxy, fault);
    check(on_serial, serial.proxy, fault);
  }
}

TEST_CASE("a silent unit leaves value and command as they were, until they are too old",
          "[modbus][link]") {
  struct Case {
    std::int64_t max_age_ns;
    bool tolerated;
  };
  const Case one = GENERATE(Case{600'000'000'000, true}, Case{100'000'000, false}, Case{0, false});
  const std::string fault = GENERATE("silent", "down");
  CAPTURE(fault, one.max_age_ns);
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  mb::PointSettings pv = input(0, RegisterType::f32);
  pv.max_age_ns = one.max_age_ns;
  mb::PointSettings co = input(2, RegisterType::u16);
  co.reg.table = mb::Table::holding_register;
  co.max_age_ns = one.max_age_ns;
  mb::LinkTask task;
  task.name = "loop";
  task.period_ns = 20'000'000;
  task.reads.push_back(std::make_unique<mb::ReadPoint>(pv));
  task.command = std::make_unique<mb::CommandPoint>(co, 600'000'000'000, 600'000'000'000,
                                                    mb::CommLossSettings{});
  task.command->newest.publish(
      {.value = 7.0, .time_ns = mb::BusWaiter::now_ns(), .id = 1, .write = true});
  link.attach(task);
  const auto sample = [&] { return task.reads.front()->newest.newest(); };
  const auto state = [&] { return task.command->state.newest(); };
  REQUIRE(eventually([&] { return state().ok && sample().quality == hal::Quality::good; }));
  const std::uint64_t errors = value(task.counters.write_errors);
  rig.proxy.command(fault);
  if (one.tolerated) {
    REQUIRE(eventually([&] { return value(task.counters.write_errors) > errors + 6; }));
    CHECK(state().ok);
    CHECK(sample().quality == hal::Quality::good);
    rig.proxy.command("up");
    const auto seen = sample().sequence;
    REQUIRE(eventually([&] { return sample().sequence > seen; }));
    CHECK(state().ok);
  } else {
    REQUIRE(eventually([&] { return !state().ok && sample().quality == hal::Quality::bad; }));
    CHECK(state().reason == Reason::link_lost);
    CHECK(sample().reason == Reason::link_lost);
  }
  link.detach(task);
}

TEST_CASE("a value whose replies are spoiled ages, is asked each period, and the line is reported",
          "[modbus][link]") {
  SerialRig rig;
  Events events;
  mb::ModbusLink link(rig.link(), events.sink());
  mb::PointSettings spoiled = input(2, RegisterType::u16);
  spoiled.reg.table = mb::Table::holding_register;
  Reader other(link, {input(0, RegisterType::f32)});
  Reader reader(link, {spoiled});
  REQUIRE(eventually([&] { return reader.good() && other.good(); }));
  rig.proxy.command("spoil 3");
  REQUIRE(eventually([&] { return events.count(Kind::device_error) == 1; }));
  CHECK_THAT(events.text(Kind::device_error),
             Catch::Contains("reading holding register") && Catch::Contains("Check the line"));
  const std::uint64_t replies = value(reader.counters().invalid_replies);
  REQUIRE(eventually([&] { return value(reader.counters().invalid_replies) > replies + 4; }));
  CHECK(eventually([&] { return reader.good() && other.good(); }));
  CHECK(events.count(Kind::device_error) == 1);
  rig.proxy.command("ok");
  reader.forget();
  CHECK(eventually([&] { return reader.fresh(); }));
}

TEST_CASE("a device that closes the connection after each reply works, and that is reported once",
          "[modbus][link]") {
  TcpRig rig;
  rig.proxy.command("close_each");
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink link(settings, events.sink());
  Reader reader(link, {input(0, RegisterType::f32), input(30, RegisterType::u16)});
  REQUIRE(eventually([&] { return events.count(Kind::closes_connections) == 1; }));
  // The connection that was being made while this was reported still has its own line.
  const auto reported = reader.sample(1).sequence;
  REQUIRE(eventually([&] { return reader.sample(1).sequence > reported + 1; }));
  const std::uint64_t reconnects = link.reconnects();
  const int lines = events.count(Kind::connected) + events.count(Kind::disconnected);
  const auto seen = reader.sample(1).sequence;
  bool bad = false;
  REQUIRE(eventually([&] {
    bad = bad || reader.bad(0) || reader.bad(1);
    return reader.sample(1).sequence > seen + 20;
  }));
  CHECK_FALSE(bad);
  CHECK(link.reconnects() == reconnects);
  CHECK(events.count(Kind::connected) + events.count(Kind::disconnected) == lines);
  CHECK(events.count(Kind::closes_connections) == 1);
}

TEST_CASE("RTU: an echo and stray bytes are ignored and reported", "[modbus][link]") {
  for (const char* fault : {"echo", "stray 1", "stray 2", "stray_before 1", "stray_before 3"}) {
    CAPTURE(fault);
    // A busy computer can cut a reply in two.
    bool undisturbed = false;
    for (int attempt = 0; attempt < 5 && !undisturbed; ++attempt) {
      SerialRig rig;
      rig.proxy.command(fault);
      Events events;
      mb::ModbusLink link(rig.link(), events.sink());
      Reader reader(link, kTags);
      for (std::size_t i = 0; i < kTags.size(); ++i)
        REQUIRE(eventually([&] { return reader.good(i); }));
      CHECK(watch_tags(reader, 300ms) > 5);
      const bool echo = std::string(fault) == "echo";
      CHECK((events.count(Kind::echo) > 0) == echo);
      CHECK((events.count(Kind::stray_bytes) > 0) == !echo);
      undisturbed = value(reader.counters().invalid_replies) == 0 &&
                    value(reader.counters().stale_replies_discarded) == 0;
    }
    CHECK(undisturbed);
  }
}

TEST_CASE("values that can't be trusted are bad", "[modbus][link]") {
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  mb::PointSettings with_status = input(0, RegisterType::f32);
  with_status.status = mb::StatusRegister{mb::Table::input_register, 18, 0x0003, 0x0000};
  Reader reader(link, {with_status});
  REQUIRE(eventually([&] { return reader.good(); }));

  rig.device.command("status 2");
  REQUIRE(eventually([&] { return reader.sample().reason == Reason::sensor_failure; }));
  CHECK(reader.bad());
  rig.device.command("status 4");  // outside the mask
  REQUIRE(eventually([&] { return reader.good(); }));

  rig.device.command("pv nan");
  REQUIRE(eventually([&] { return reader.sample().reason == Reason::not_finite; }));
  CHECK(reader.bad());
  rig.device.command("pv inf");
  const std::uint64_t asked = value(reader.counters().transactions);
  REQUIRE(eventually([&] { return value(reader.counters().transactions) > asked + 4; }));
  CHECK(reader.bad());
  rig.device.command("pv 3");
  CHECK(eventually([&] { return reader.good() && reader.sample().value == Approx(3.0); }));
}

TEST_CASE("RTU: no late reply passes for a fresh one", "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  Reader reader(link, kTags);
  for (std::size_t i = 0; i < kTags.size(); ++i)
    REQUIRE(eventually([&] { return reader.good(i); }));

  // Less than the response timeout, more, more than the drain, and long after all of them.
  for (const char* fault : {"late 30 5", "late 200 3", "late 320 4", "late 1100 3", "late 2000 2",
                            "duplicate 10", "duplicate_late 40 20"}) {
    CAPTURE(fault);
    rig.proxy.command(fault);
    watch_tags(reader, 600ms);
    REQUIRE(eventually([&] { return reader.good(0) && reader.good(3); }));
  }
  CHECK(value(reader.counters().stale_replies_discarded) > 0);
  rig.proxy.command("ok");
  CHECK(eventually([&] { return watch_tags(reader, 300ms) > 5; }));
}

TEST_CASE("RTU: a repeated reply is harmless", "[modbus][link]") {
  SerialRig rig;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink link(settings, {});
  Reader reader(link, {kTags[0], kTags[1]});
  REQUIRE(eventually([&] { return reader.good(0) && reader.good(1); }));
  for (int i = 0; i < 5; ++i) {
    const std::uint64_t discarded = value(reader.counters().stale_replies_discarded);
    rig.proxy.command("duplicate 1");
    REQUIRE(
        eventually([&] { return value(reader.counters().stale_replies_discarded) > discarded; }));
  }
  reader.forget();
  REQUIRE(eventually([&] { return reader.fresh(0); }));
  CHECK(value(reader.counters().invalid_replies) == 0);
  CHECK(value(reader.counters().timeouts) == 0);
}

TEST_CASE("RTU: a reply later than the drain does not answer the same question asked again",
          "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  Reader reader(link, {kTags[0]});
  for (const char* fault : {"late 330 1", "late 450 1", "late 330 2", "late 600 3"}) {
    CAPTURE(fault);
    reader.forget();
    REQUIRE(eventually([&] { return reader.fresh(); }));
    rig.proxy.command(fault);
    watch_tags(reader, 800ms, 1);
  }
  CHECK(value(reader.counters().stale_replies_discarded) > 0);
}

TEST_CASE("RTU: a device that is always late is bad, never stale", "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  Reader reader(link, kTags);
  REQUIRE(eventually([&] { return reader.good(3); }));
  for (const char* fault : {"late 180", "late 330", "late 700"}) {
    CAPTURE(fault);
    rig.proxy.command(fault);
    watch_tags(reader, 1000ms);
    // If this thread was held up, a reply may have been there in time after all.
    CHECK(eventually([&] { return reader.bad(0); }));
    rig.proxy.command("ok");
    reader.forget();
    REQUIRE(eventually([&] { return reader.fresh(0); }));
  }
}

TEST_CASE("TCP: no late reply passes for a fresh one", "[modbus][link]") {
  TcpRig rig;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 150;
  mb::ModbusLink link(settings, {});
  Reader reader(link, kTags);
  REQUIRE(eventually([&] { return reader.good(3); }));
  for (const char* fault : {"late 30 5", "late 160 2", "late 400 3", "late 2000 2", "duplicate 10",
                            "duplicate_late 20 20"}) {
    CAPTURE(fault);
    rig.proxy.command(fault);
    watch_tags(reader, 450ms);
    rig.proxy.command("ok");
    REQUIRE(eventually([&] { return reader.good(0) && reader.good(3); }));
  }
  CHECK(eventually([&] { return watch_tags(reader, 300ms) > 5; }));
}

TEST_CASE("RTU: a unit with few registers is read without the extra ones", "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  // The device's last two registers: the second read can't be longer than needed.
  Reader reader(link, {input(116, RegisterType::u32), input(118, RegisterType::u32)});
  REQUIRE(eventually([&] { return reader.good(0) && reader.good(1); }));
}

TEST_CASE("RTU: a dead unit holds up the others for no more than a probe", "[modbus][link]") {
  SerialRig rig({"--units", "1,2"});
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.probe_interval_s = 1.0;
  mb::ModbusLink link(settings, events.sink());
  Reader alive(link, {input(30, RegisterType::u16)});
  Reader dying(link, {input(30, RegisterType::u16, ByteOrder::abcd, 1.0, 2)});
  Reader absent(link, {input(30, RegisterType::u16, ByteOrder::abcd, 1.0, 9)});
  REQUIRE(eventually([&] { return alive.good() && dying.good(); }));
  CHECK(dying.sample().value == 2.0);

  struct Watched {
    int fresh = 0;
    std::int64_t longest_gap_ns = 0;
  };
  const auto watch = [&] {
    Watched seen;
    std::int64_t last_ns = alive.sample().time_ns;
    const auto end = std::chrono::steady_clock::now() + 2s;
    while (std::chrono::steady_clock::now() < end) {
      if (alive.fresh()) {
        ++seen.fresh;
        seen.longest_gap_ns = std::max(seen.longest_gap_ns, alive.sample().time_ns - last_ns);
        last_ns = alive.sample().time_ns;
      }
      std::this_thread::sleep_for(1ms);
    }
    return seen;
  };
  const Watched before = watch();  // one unit is absent already; the load of the host shows here

  rig.proxy.command("mute 2");
  REQUIRE(eventually([&] { return dying.bad() && events.count(Kind::unit_silent) >= 2; }));
  REQUIRE(eventually([&] { return alive.fresh(); }));

  // Two dead units, each probed about once a second for 150 ms: most periods of 20 ms stay free.
  const Watched after = watch();
  CHECK(4 * after.fresh > before.fresh);
  CHECK(after.longest_gap_ns < before.longest_gap_ns + 5'000'000'000);  // two probes and slack
  CHECK(absent.bad());

  rig.proxy.command("mute 0");
  CHECK(eventually([&] { return dying.good(); }));
  CHECK(events.count(Kind::unit_back) >= 1);
}

TEST_CASE("a vanished peer is noticed and found again", "[modbus][link]") {
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  Reader reader(link, {input(0, RegisterType::f32)});
  REQUIRE(eventually([&] { return reader.good(); }));
  rig.proxy.freeze();  // the kernel still accepts connections, but the device doesn't answer
  REQUIRE(eventually([&] { return reader.bad(); }));
  reader.forget();
  rig.proxy.thaw();
  CHECK(eventually([&] { return reader.fresh(); }));
}

TEST_CASE("a link ends promptly, whatever it waits for", "[modbus][link]") {
  TcpRig rig;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 600'000;
  settings.reconnect_min_s = 600.0;
  settings.reconnect_max_s = 600.0;
  for (const char* fault : {"silent", "down"}) {
    CAPTURE(fault);
    rig.proxy.command("up");
    rig.proxy.command(fault);
    mb::LinkTask task;
    task.reads.push_back(std::make_unique<mb::ReadPoint>(input(0, RegisterType::f32)));
    Events events;
    auto link = std::make_unique<mb::ModbusLink>(settings, events.sink());
    link->attach(task);
    if (std::string(fault) == "silent") {
      const std::uint64_t ticks = link->ticks();
      REQUIRE(eventually([&] { return link->ticks() > ticks + 5; }));
    } else {
      REQUIRE(eventually([&] { return events.count(Kind::connect_failed) == 1; }));
    }
    const auto start = std::chrono::steady_clock::now();
    link.reset();
    CHECK(std::chrono::steady_clock::now() - start < 60s);
  }
}

TEST_CASE(
    "after a silence in which the device may act, the loop is informed before its commands pass",
    "[modbus][link]") {
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  mb::PointSettings point = input(0, RegisterType::f32);
  point.reg.table = mb::Table::holding_register;
  constexpr std::int64_t kMaxAgeNs = 60'000'000'000;
  constexpr std::int64_t kSilenceNs = 200'000'000;
  mb::LinkTask task;
  task.name = "loop";
  task.period_ns = 3'600'000'000'000;  // served on request
  task.command =
      std::make_unique<mb::CommandPoint>(point, kMaxAgeNs, kSilenceNs, mb::CommLossSettings{});
  link.attach(task);
  std::uint64_t id = 0;
  const auto decide = [&](double output) {
    task.command->newest.publish(
        {.value = output, .time_ns = mb::BusWaiter::now_ns(), .id = ++id, .write = true});
    link.serve_soon(task);
  };
  const auto state = [&] { return task.command->state.newest(); };
  decide(4.0);
  REQUIRE(eventually([&] { return state().ok; }));
  CHECK(rig.device.state_number("co") == 4.0);

  std::this_thread::sleep_for(300ms);
  decide(6.0);
  REQUIRE(eventually([&] { return !state().ok; }));
  CHECK(state().reason == Reason::link_lost);
  // The repeated command was decided without information about the silence.
  link.serve_soon(task);
  std::this_thread::sleep_for(100ms);
  CHECK(rig.device.state_number("co") == 4.0);
  CHECK_FALSE(state().ok);

  decide(5.0);
  REQUIRE(eventually([&] { return state().ok; }));
  CHECK(rig.device.state_number("co") == 5.0);
  link.detach(task);
}

TEST_CASE("a silence that the loop asks for is no silence of the bus", "[modbus][link]") {
  TcpRig rig;
  mb::ModbusLink link(rig.link(), {});
  mb::PointSettings point = input(0, RegisterType::f32);
  point.reg.table = mb::Table::holding_register;
  mb::LinkTask task;
  task.name = "loop";
  task.period_ns = 20'000'000;
  task.command = std::make_unique<mb::CommandPoint>(point, 60'000'000'000, 2'000'000'000,
                                                    mb::CommLossSettings{});
  link.attach(task);
  std::uint64_t id = 0;
  const auto decide = [&](double output, bool write) {
    task.command->newest.publish(
        {.value = output, .time_ns = mb::BusWaiter::now_ns(), .id = ++id, .write = write});
  };
  const auto state = [&] { return task.command->state.newest(); };
  decide(4.0, true);
  REQUIRE(eventually([&] { return state().ok; }));
  decide(4.0, false);
  std::this_thread::sleep_for(3s);
  decide(6.0, true);
  const std::uint64_t newest = id;
  REQUIRE(eventually([&] { return state().written_id == newest || !state().ok; }));
  CHECK(state().ok);
  CHECK(rig.device.state_number("co") == 6.0);
  link.detach(task);
}

TEST_CASE("a command that is refused for a moment is repeated; for long, the output is lost",
          "[modbus][link]") {
  TcpRig rig;
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 2000;
  mb::ModbusLink link(settings, events.sink());
  mb::PointSettings point = input(2, RegisterType::u16);
  point.reg.table = mb::Table::holding_register;
  mb::LinkTask task;
  task.name = "loop";
  task.period_ns = 20'000'000;
  task.command = std::make_unique<mb::CommandPoint>(point, 600'000'000'000, 1'000'000'000,
                                                    mb::CommLossSettings{});
  std::uint64_t id = 0;
  const auto decide = [&] {
    task.command->newest.publish(
        {.value = 7.0, .time_ns = mb::BusWaiter::now_ns(), .id = ++id, .write = true});
  };
  decide();
  link.attach(task);
  const auto state = [&] { return task.command->state.newest(); };
  REQUIRE(eventually([&] { return state().ok; }));
  for (const char* fault : {"exception 5 1", "exception 6 1", "exception 10 1", "exception 11 1",
                            "garbage 1", "refuse 16 0"}) {
    CAPTURE(fault);
    const std::uint64_t errors = value(task.counters.write_errors);
    bool lost = false;
    rig.proxy.command(fault);
    REQUIRE(eventually([&] {
      lost = lost || !state().ok;
      return value(task.counters.write_errors) > errors;
    }));
    if (std::string(fault) == "refuse 16 0") break;
    const std::uint64_t writes = value(task.counters.writes);
    REQUIRE(eventually([&] {
      decide();
      lost = lost || !state().ok;
      return value(task.counters.writes) > writes;
    }));
    CHECK_FALSE(lost);
  }
  // Refused permanently: reported at once, with the key that may help.
  REQUIRE(eventually([&] { return !state().ok; }));
  CHECK(state().reason == Reason::device_error);
  CHECK_THAT(events.text(Kind::device_error),
             Catch::Contains("exception 1 (illegal function)") &&
                 Catch::Contains("writing holding register 2 (function 16)") &&
                 Catch::Contains("write_function: single"));
  rig.proxy.command("ok");
  REQUIRE(eventually([&] {
    decide();
    return state().ok;
  }));
  rig.proxy.command("exception 6");
  REQUIRE(eventually([&] {
    decide();
    return !state().ok;
  }));
  CHECK(mb::BusWaiter::now_ns() - state().confirmed_ns > 1'000'000'000);
  link.detach(task);
}

TEST_CASE("a device that answers reads but ignores a write is reported with the key",
          "[modbus][link]") {
  TcpRig rig;
  Events events;
  mb::LinkSettings settings = rig.link();
  settings.response_timeout_ms = 100;
  mb::ModbusLink link(settings, events.sink());
  mb::PointSettings point = input(2, RegisterType::u16);
  point.reg.table = mb::Table::holding_register;
  mb::LinkTask task;
  task.name = "loop";
  task.period_ns = 20'000'000;
  task.command = std::make_unique<mb::CommandPoint>(point, 600'000'000'000, 300'000'000,
                                                    mb::CommLossSettings{});
  task.reads.push_back(std::make_unique<mb::ReadPoint>(input(0, RegisterType::f32)));
  task.command->newest.publish(
      {.value = 7.0, .time_ns = mb::BusWaiter::now_ns(), .id = 1, .write = true});
  rig.proxy.command("ignore 16");
  link.attach(task);
  REQUIRE(eventually([&] { return events.count(Kind::device_error) > 0; }));
  CHECK_THAT(events.text(Kind::device_error), Catch::Contains("answers other requests") &&
                                                  Catch::Contains("write_function: single"));
  CHECK_FALSE(task.command->state.newest().ok);
  CHECK(eventually([&] { return task.reads[0]->newest.newest().quality == hal::Quality::good; }));
  link.detach(task);
}

TEST_CASE("points are added and removed while the link runs", "[modbus][link]") {
  SerialRig rig;
  mb::ModbusLink link(rig.link(), {});
  Reader first(link, {input(40, RegisterType::u32)});
  for (int i = 0; i < 5; ++i) {
    Reader second(link, {input(42, RegisterType::u32)});
    REQUIRE(eventually([&] { return second.good(); }));
    CHECK(Tag(second.sample().value).register_number == 42);
  }
  first.forget();
  CHECK(eventually([&] { return first.fresh(); }));
}

}  // namespace modbus_link_test
