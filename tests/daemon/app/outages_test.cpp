// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/outages.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "daemon/host/host_judge.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::outages_test {
namespace {

using namespace daemon;
using alarm::AlarmKind;
using alarm::AlarmState;
using alarm::BoxAlarm;
using base::Reason;

hal::feed::FeedSettings fed(const std::string& feeder, const std::string& name) {
  return {.process_variable = {.name = {feeder, name + ".PV"}},
          .output = {.name = {feeder, name + ".OP"}}};
}

hal::modbus::LoopModbusSettings modbus(std::uint8_t unit) {
  hal::modbus::LoopModbusSettings io;
  io.transmitter_link.name = "plc";
  io.transmitter_link.host = "10.0.0.5";
  io.process_variable.unit = unit;
  return io;
}

struct Bench {
  Bench() {
    loops[0].config.io = fed("opcua", "A");
    loops[1].config.io = fed("opcua", "B");
    loops[2].config.io = modbus(1);
    loops[3].config.io = modbus(2);
    for (std::size_t i = 0; i < loops.size(); ++i) loops[i].config.name = alarms.name(i);
    table.slot({"opcua", "A.PV"});
    table.slot({"opcua", "B.PV"});
    table.feeder("opcua").counters().connected = true;
  }
  void feed_bad(const std::string& name, const std::string& source) {
    table.feeder("opcua").put(name, {.quality = hal::Quality::bad, .source = source},
                              {.now_ns = 1});
  }
  void silent(std::size_t loop, Reason reason) {
    alarms.of(loop).set_pv_silence(reason);
    const supervision::ProcessNews news{{.kind = AlarmKind::bad_pv, .on = reason != Reason::none},
                                        "test"};
    alarms.of(loop).process_changed({&news, 1});
  }
  AlarmState bad_pv(std::size_t loop) const {
    return alarms.snapshot(loop).alarms.alarm(AlarmKind::bad_pv).state();
  }
  host::LostConnections look(double uptime_s = 100.0) {
    host::LostConnections lost = outages.look(uptime_s);
    now_ms += 20'000;
    box.look(judge.judge({.monotonic_ms = now_ms,
                          .utc_ms = now_ms,
                          .lost_feeders = lost.feeders,
                          .lost_connections = lost.connections}),
             now_ms);
    return lost;
  }
  AlarmState connection() const { return box.alarms().alarm(BoxAlarm::connection_lost).state(); }

  TemporaryFolder folder;
  std::int64_t now_ms = 1'800'000'000'000;
  journal::Journal journal{{.folder = folder.path()}};
  std::vector<LoopRuntime> loops = std::vector<LoopRuntime>(4);
  supervision::AlarmRegistry alarms{
      {{"A", 1.0}, {"B", 1.0}, {"C", 1.0}, {"D", 1.0}}, {}, journal, [this] { return now_ms; }};
  host::HostAlarms box{{}, journal, [this] { return now_ms; }};
  host::HostJudge judge;
  hal::feed::FeedTable table;
  Outages outages{loops, table, alarms, box};
};

}  // namespace

TEST_CASE("a lost server is one alarm; its loops are suppressed until they have cleared",
          "[outages]") {
  Bench bench;
  for (const char* name : {"A.PV", "B.PV"}) bench.feed_bad(name, "server opc.tcp://dcs");
  bench.silent(0, Reason::link_lost);
  bench.silent(1, Reason::link_lost);
  const host::LostConnections lost = bench.look();
  REQUIRE(lost.connections.size() == 1);
  CHECK(lost.connections[0].what == "server opc.tcp://dcs (opcua)");
  CHECK(lost.connections[0].loops == std::vector<std::string>{"A", "B"});
  CHECK(bench.bad_pv(0) == AlarmState::suppressed);
  bench.look();
  CHECK(bench.connection() == AlarmState::unacknowledged);
  // PV is back, its alarm has not cleared yet.
  bench.alarms.of(0).set_pv_silence(Reason::none);
  bench.look();
  CHECK(bench.bad_pv(0) == AlarmState::suppressed);
  bench.silent(0, Reason::none);
  bench.look();
  CHECK(bench.bad_pv(0) == AlarmState::normal);
}

TEST_CASE("an alarm that is still present after an outage is raised after the on-delay",
          "[outages]") {
  Bench bench;
  alarm::ProcessSettings settings;
  alarm::ProcessWatch watch(1.0, settings);
  alarm::ProcessCycle cycle{.pv_good = true,
                            .output_arrives = true,
                            .mode = control::Mode::manual,
                            .requested_mode = control::Mode::automatic};
  const auto pass = [&](std::uint64_t seconds) {
    for (std::uint64_t k = 0; k < seconds; ++k) {
      ++cycle.period_index;
      const alarm::ProcessChanges changes = watch.add(cycle);
      for (const alarm::ProcessChange& change : changes.view()) {
        const supervision::ProcessNews news{change, "test"};
        bench.alarms.of(0).process_changed({&news, 1});
      }
    }
    bench.alarms.of(0).set_conditions(watch);
  };
  const auto mode = [&] {
    return bench.alarms.snapshot(0).alarms.alarm(AlarmKind::not_normal_mode).state();
  };
  bench.feed_bad("A.PV", "server opc.tcp://dcs");
  bench.alarms.of(0).set_pv_silence(Reason::link_lost);
  cycle.pv_good = false;
  cycle.pv_bad = cycle.pv_silent = true;
  bench.look();
  pass(20);
  REQUIRE(mode() == AlarmState::suppressed);
  // PV is back. The loop is still in manual; bad_pv clears after its off-delay.
  bench.alarms.of(0).set_pv_silence(Reason::none);
  cycle.pv_good = true;
  cycle.pv_bad = cycle.pv_silent = false;
  pass(1);
  bench.outages.look(100.0);
  CHECK(mode() == AlarmState::suppressed);
  bench.now_ms += 10'000;
  bench.outages.look(100.0);
  CHECK(mode() == AlarmState::unacknowledged);
  CHECK(bench.bad_pv(0) == AlarmState::suppressed);
  // A second outage suppresses it again.
  bench.alarms.of(0).set_pv_silence(Reason::link_lost);
  bench.outages.look(100.0);
  CHECK(mode() == AlarmState::suppressed);
}

TEST_CASE("a lost feeder is the alarm of the feeder; a name without values is the loop's own",
          "[outages]") {
  Bench bench;
  bench.silent(0, Reason::never_received);
  CHECK(bench.look().feeders.empty());
  CHECK(bench.bad_pv(0) == AlarmState::unacknowledged);
  bench.table.feeder("opcua").counters().connected = false;
  const host::LostConnections lost = bench.look();
  REQUIRE(lost.feeders.size() == 1);
  CHECK(lost.feeders[0].what == "opcua");
  CHECK(lost.connections.empty());
  CHECK(bench.bad_pv(0) == AlarmState::suppressed);
}

TEST_CASE("units of one link are one connection; another lost one raises the alarm again",
          "[outages]") {
  Bench bench;
  bench.silent(2, Reason::link_lost);
  bench.look();
  bench.look();
  REQUIRE(bench.connection() == AlarmState::unacknowledged);
  CHECK(bench.box.priority(BoxAlarm::connection_lost) == alarm::Priority::critical);
  bench.box.acknowledge_all("test", "");
  bench.look();
  CHECK(bench.connection() == AlarmState::acknowledged);
  bench.silent(3, Reason::link_lost);
  CHECK(bench.look().connections.at(0).what == "link plc (Modbus 10.0.0.5:502), unit 1, 2");
  CHECK(bench.connection() == AlarmState::unacknowledged);
}

}  // namespace loopwarden::tests::outages_test
