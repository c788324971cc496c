// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/map_bank.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "daemon/registers/register_map.hpp"
#include "tests/daemon/gateway/fake_loops.hpp"

namespace loopwarden::daemon::gateway::map_bank_test {
namespace {

using hal::modbus::ByteOrder;
using registers::Table;
using Words = std::vector<std::uint16_t>;
using model_kind = alarm::AlarmKind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Peer kMaster{"10.0.0.7:1000", true};

struct Bench {
  explicit Bench(std::size_t loops = 2, ByteOrder order = ByteOrder::abcd)
      : plant(loops), server{.word_order = order}, bank(plant, server) {}

  std::uint32_t address(Table table, const std::string& name, std::size_t loop,
                        registers::Area area = registers::Area::loop) const {
    for (const registers::Register& reg : registers::registers()) {
      if (reg.table == table && reg.area == area && name == reg.name) {
        return registers::address(reg, loop);
      }
    }
    FAIL("no register " << name);
    return 0;
  }
  Words read(Table table, std::uint32_t at, std::size_t count) {
    Words words(count);
    REQUIRE(bank.read(table, static_cast<std::uint16_t>(at), words) == Exception::none);
    return words;
  }
  std::uint16_t word(const std::string& name, std::size_t loop = 0,
                     Table table = Table::input_register) {
    return read(table, address(table, name, loop), 1)[0];
  }
  std::uint16_t box_word(const std::string& name, Table table = Table::input_register) {
    return read(table, address(table, name, 0, registers::Area::box), 1)[0];
  }
  float number(const std::string& name, std::size_t loop = 0, Table table = Table::input_register) {
    const Words w = read(table, address(table, name, loop), 2);
    return std::bit_cast<float>(static_cast<std::uint32_t>(w[0]) << 16 | w[1]);
  }
  Exception write(const std::string& name, const Words& words, std::size_t loop = 0,
                  Table table = Table::holding_register) {
    return bank.write(table, static_cast<std::uint16_t>(address(table, name, loop)), words,
                      kMaster);
  }
  static Words words_of(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return {static_cast<std::uint16_t>(bits >> 16), static_cast<std::uint16_t>(bits)};
  }

  tests::FakeLoops plant;
  ServerState server;
  MapBank bank;
};

}  // namespace

TEST_CASE("the test constants in every word order", "[gateway][map]") {
  const auto at = [](ByteOrder order) {
    Bench bench(1, order);
    return bench.read(Table::input_register, 14, 4);
  };
  CHECK(at(ByteOrder::abcd) == Words{0x47F1, 0x2000, 0x0102, 0x0304});
  CHECK(at(ByteOrder::cdab) == Words{0x2000, 0x47F1, 0x0304, 0x0102});
  CHECK(at(ByteOrder::badc) == Words{0xF147, 0x0020, 0x0201, 0x0403});
  CHECK(at(ByteOrder::dcba) == Words{0x0020, 0xF147, 0x0403, 0x0201});
  // Single registers have the byte order of Modbus in each.
  for (const ByteOrder order :
       {ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc, ByteOrder::dcba}) {
    Bench bench(1, order);
    CHECK(bench.box_word("magic") == 0x4C50);
    CHECK(bench.box_word("word_order") == static_cast<std::uint16_t>(order));
  }
}

TEST_CASE("the block of the host", "[gateway][map]") {
  Bench bench(3);
  CHECK(bench.box_word("heartbeat") == 4);  // 65540 s, wrapped
  CHECK(bench.box_word("loop_count") == 3);
  CHECK(bench.box_word("utc_milliseconds") == 123);
  CHECK(bench.read(Table::input_register, 22, 2) ==
        Words{1'800'000'000 >> 16, 1'800'000'000 & 0xFFFF});
  bench.plant.box_reading.wake_up_worst_us = 1e9;
  CHECK(bench.box_word("wake_up_worst") == 65535);
  CHECK(bench.box_word("status_bits") == 1);
  bench.plant.box_reading.any_simulated = true;
  bench.plant.box_reading.journal_trouble = true;
  bench.plant.box_reading.real_time_rights = false;
  bench.server.writes_enabled = true;
  bench.server.master_lost = true;
  alarm::AlarmConditions on{};
  on[0] = {true, 5.0};
  bench.plant.readings[1].watch.alarms.window_judged(0, on);
  CHECK(bench.box_word("status_bits") == 127);
  CHECK(bench.box_word("alarms_active") == 1);
  CHECK(bench.box_word("alarms_unacknowledged") == 1);
  CHECK(bench.box_word("any_alarm_unacknowledged", Table::discrete_input) == 1);
}

TEST_CASE("a loop's block: values, scaled copies, and one sequence for all of it",
          "[gateway][map]") {
  Bench bench;
  CHECK(bench.number("sp") == 50.0F);
  CHECK(bench.number("pv") == 49.5F);
  CHECK(bench.number("co") == 25.0F);
  CHECK(bench.number("stem") == 24.0F);
  CHECK(bench.word("sp_scaled") == 5000);
  CHECK(bench.word("pv_scaled") == 4950);
  CHECK(bench.word("pv_quality") == 192);
  CHECK(bench.word("sequence_head", 1) == (70'001 & 0xFFFF));
  CHECK(bench.word("sequence_tail", 1) == (70'001 & 0xFFFF));
  bench.plant.reads = 0;
  const Words block = bench.read(Table::input_register, 64, 64);
  CHECK(bench.plant.reads == 1);
  CHECK(block.front() == block.back());
}

TEST_CASE("each bit of a loop has one meaning, and each count of the box is in its register",
          "[gateway][map]") {
  Bench bench;
  record::RecordRow& row = bench.plant.readings[0].row;
  row.stem = kNan;
  CHECK(bench.word("loop_bits") == 0);
  const auto bits = [&](record::RecordFlag flag) {
    row.flags = flag;
    return bench.word("loop_bits");
  };
  CHECK(bits(record::kAtLow) == 1);
  CHECK(bits(record::kAtHigh) == 2);
  CHECK(bits(record::kRateLimited) == 4);
  CHECK(bits(record::kOutputLost) == 8);
  CHECK(bits(record::kJacketActs) == 16);
  CHECK(bits(record::kCompensatorActs) == 64);
  BoxReading& box = bench.plant.box_reading;
  box.journal_waiting = 2;
  box.journal_lost = 3;
  box.window_backlog = 4;
  box.monitor_dropped = 5;
  CHECK(bench.box_word("journal_waiting") == 2);
  CHECK(bench.box_word("journal_lost") == 3);
  CHECK(bench.box_word("window_backlog") == 4);
  const std::uint32_t dropped =
      bench.address(Table::input_register, "monitor_dropped", 0, registers::Area::box);
  CHECK(bench.read(Table::input_register, dropped, 2) == Words{0, 5});
  CHECK(bench.box_word("status_bits") == 1);
  box.journal_trouble = true;
  CHECK(bench.box_word("status_bits") == 1 + 16);
  box.journal_trouble = false;
  box.real_time_rights = false;
  CHECK(bench.box_word("status_bits") == 1 + 32);
}

TEST_CASE("a missing value is never sent as a number", "[gateway][map]") {
  Bench bench;
  record::RecordRow& row = bench.plant.readings[0].row;
  row.pv = kNan;
  row.stem = kNan;
  row.pv_quality = base::Quality::bad;
  bench.plant.readings[0].last_good_pv = 48.25;
  CHECK(bench.number("pv") == 48.25F);
  CHECK(bench.word("pv_scaled") == 0x8000);
  CHECK(bench.number("stem") == 0.0F);
  CHECK(bench.word("stem_scaled") == 0x8000);
  CHECK((bench.word("loop_bits") & 32U) == 0);
  CHECK(bench.word("pv_bad", 0, Table::discrete_input) == 1);
  row.sp = std::numeric_limits<double>::infinity();
  row.co = 1e300;
  for (const registers::Register& reg : registers::registers()) {
    if (reg.type != hal::modbus::RegisterType::f32 || reg.area != registers::Area::loop) continue;
    INFO(reg.name);
    CHECK(std::isfinite(bench.number(reg.name, 0, reg.table)));
  }
  // The lowest number of a scaled copy marks a missing value: no real value uses it.
  row.pv = -1e6;
  row.pv_quality = base::Quality::good;
  CHECK(bench.word("pv_scaled") == 0x8001);
}

TEST_CASE("condition indices have a separate block, and a mark for an unknown index",
          "[gateway][map]") {
  Bench bench;
  bench.plant.readings[1].watch.condition = {
      .control_performance = 99.5, .valve = 0.0, .actuator = 12.34, .positioner = 100.0};
  CHECK(bench.box_word("first_condition") == 0xE000);
  CHECK(bench.box_word("condition_stride") == 8);
  CHECK(bench.read(Table::input_register, 0xE008, 8) ==
        Words{9950, 0, 1234, 10'000, 0x8000, 0, 0, 0});
  // The other loop: no index is known yet.
  CHECK(bench.read(Table::input_register, 0xE000, 5) == Words(5, 0x8000));
  Words words(9);
  CHECK(bench.bank.read(Table::input_register, 0xE008, words) == Exception::illegal_address);
}

TEST_CASE("alarms in registers and bits", "[gateway][map]") {
  Bench bench;
  alarm::AlarmConditions on{};
  on[1] = {true, 6.25};
  auto& alarms = bench.plant.readings[0].watch.alarms;
  alarms.window_judged(0, on);
  CHECK(bench.word("alarm_backlash") == 1);
  CHECK(bench.word("alarm_stiction") == 0);
  CHECK(bench.word("severity_backlash") == 625);
  CHECK(bench.word("active_backlash", 0, Table::discrete_input) == 1);
  CHECK(bench.word("active_stiction", 0, Table::discrete_input) == 0);
  CHECK(bench.word("unacknowledged_backlash", 0, Table::discrete_input) == 1);
  CHECK(bench.word("alarm_backlash", 1) == 7);  // the other loop: no window judged yet
  on[4] = {true, 6.5};  // `unknown`: the cause is unknown, and so is its size
  alarms.window_judged(0, on);
  CHECK(bench.word("alarm_unknown") == 1);
  CHECK(bench.word("severity_unknown") == 0);
  alarms.act(model_kind::backlash, alarm::AlarmAction::shelve, bench.plant.box().utc_ms,
             bench.plant.box_reading.utc_ms + 90'000);
  CHECK(bench.word("alarm_backlash") == 6);
  CHECK(bench.word("shelve_backlash", 0, Table::holding_register) == 2);  // 1.5 min, rounded up
  CHECK(bench.word("any_shelved", 0, Table::discrete_input) == 1);
}

TEST_CASE("reserved registers read 0, addresses outside the map are refused", "[gateway][map]") {
  Bench bench(1);
  CHECK(bench.read(Table::input_register, 41, 2) == Words{32768, 32});
  CHECK(bench.read(Table::input_register, 43, 21) == Words(21, 0));
  Words words(2);
  CHECK(bench.bank.read(Table::input_register, 128, words) == Exception::illegal_address);
  CHECK(bench.bank.read(Table::input_register, 127, words) == Exception::illegal_address);
  CHECK(bench.bank.read(Table::holding_register, 64, words) == Exception::illegal_address);
  CHECK(bench.bank.write(Table::holding_register, 1, Words{1}, kMaster) ==
        Exception::illegal_address);
  CHECK(bench.bank.write(Table::holding_register, 5000, Words{1}, kMaster) ==
        Exception::illegal_address);
}

TEST_CASE("commands reach the loop, and the journal names peer, old and new value",
          "[gateway][map]") {
  Bench bench;
  CHECK(bench.write("sp", Bench::words_of(55.5F), 1) == Exception::none);
  REQUIRE(bench.plant.commands.size() == 1);
  CHECK(bench.plant.commands[0].first == 1);
  CHECK(bench.plant.commands[0].second.set_point == 55.5);
  REQUIRE(bench.plant.lines.size() == 1);
  CHECK(bench.plant.lines[0].peer == "10.0.0.7:1000");
  CHECK(bench.plant.lines[0].loop == "FIC-101");
  CHECK(bench.plant.lines[0].what == "sp");
  CHECK(bench.plant.lines[0].old_value == "60");
  CHECK(bench.plant.lines[0].new_value == "55.5");
  CHECK(bench.plant.lines[0].result == "done");

  const auto last = [&] { return bench.plant.commands.back().second; };
  CHECK(bench.write("sp_scaled", {2000}) == Exception::none);
  CHECK(*last().set_point == Approx(20.0));
  CHECK(bench.plant.lines.back().old_value == "60");
  CHECK(bench.write("mode", {0}) == Exception::none);
  CHECK(last().mode == control::Mode::manual);
  bench.plant.readings[0].availability.mode = control::Mode::manual;
  CHECK(bench.write("mode", {1}) == Exception::none);
  CHECK(last().mode == control::Mode::automatic);
  CHECK(bench.write("output", Bench::words_of(12.5F)) == Exception::none);
  CHECK(last().output == 12.5);
  CHECK(bench.write("output_scaled", {1000}) == Exception::none);
  CHECK(*last().output == Approx(10.0));
  CHECK(bench.write("kp", Bench::words_of(0.25F)) == Exception::none);
  CHECK(last().kp == 0.25);
  CHECK(bench.write("ki", Bench::words_of(0.75F)) == Exception::none);
  CHECK(last().ki == 0.75);
  CHECK(bench.write("kd", Bench::words_of(1.0F)) == Exception::none);
  CHECK(last().kd == 1.0);
}

TEST_CASE("a command that the mode forbids gets exception 06, and is refused in the journal",
          "[gateway][map]") {
  Bench bench;
  rt::LoopAvailability& availability = bench.plant.readings[0].availability;
  const auto refused = [&](const char* reason) {
    CHECK(bench.plant.commands.empty());
    REQUIRE_FALSE(bench.plant.lines.empty());
    CHECK_THAT(bench.plant.lines.back().result, Catch::StartsWith("refused: "));
    CHECK_THAT(bench.plant.lines.back().result, Catch::Contains(reason));
  };
  SECTION("an output in automatic") {
    CHECK(bench.write("output", Bench::words_of(12.5F)) == Exception::busy);
    refused("in automatic the controller has the output");
    CHECK(bench.write("output_scaled", {1250}) == Exception::busy);
    refused("in automatic the controller has the output");
    // A request that can never succeed is refused before one that can't succeed now.
    CHECK(bench.write("output", Bench::words_of(100.5F)) == Exception::illegal_value);
    refused("output must be within 0 to 100 (got 100.5)");
  }
  SECTION("an output while a fault's action has it") {
    availability = {.mode = control::Mode::manual, .output_known = true, .output_in_fault = true};
    CHECK(bench.write("output", Bench::words_of(12.5F)) == Exception::busy);
    refused("fault");
  }
  SECTION("a set point that follows PV in manual") {
    availability.mode = control::Mode::manual;
    CHECK(bench.write("sp", Bench::words_of(55.0F)) == Exception::busy);
    refused("follows PV");
    bench.plant.readings[0].settings.controller.set_point_tracks_in_manual = false;
    CHECK(bench.write("sp", Bench::words_of(55.0F)) == Exception::none);
  }
  SECTION("automatic while the position of the output is unknown") {
    availability = {.mode = control::Mode::manual, .output_known = false};
    CHECK(bench.write("mode", {1}) == Exception::busy);
    refused("output position unknown");
  }
  SECTION("automatic during a fault that ends in manual") {
    availability = {
        .mode = control::Mode::manual, .output_known = true, .manual_after_fault = true};
    CHECK(bench.write("mode", {1}) == Exception::busy);
    refused("wait in manual");
  }
  SECTION("too many commands at once") {
    bench.plant.room = false;
    CHECK(bench.write("sp", Bench::words_of(55.0F)) == Exception::busy);
    refused("too many commands at once");
  }
}

TEST_CASE(
    "an unknown output reads 0 and its scaled copy the mark, and any written value is a command",
    "[gateway][map]") {
  Bench bench;
  LoopReading& loop = bench.plant.readings[0];
  loop.row.co = kNan;
  loop.row.fault = control::Fault::output_unknown;
  loop.availability = {.mode = control::Mode::manual, .output_known = false};
  CHECK(bench.word("fault") == 8);
  CHECK(bench.number("co") == 0.0F);
  CHECK(bench.word("co_scaled") == 0x8000);
  CHECK(bench.number("output", 0, Table::holding_register) == 0.0F);
  CHECK(bench.word("output_scaled", 0, Table::holding_register) == 0x8000);
  // Closing the valve is still a command.
  CHECK(bench.write("output", Bench::words_of(0.0F)) == Exception::none);
  CHECK(bench.write("output_scaled", {2500}) == Exception::none);
  REQUIRE(bench.plant.commands.size() == 2);
  CHECK(bench.plant.commands[0].second.output == 0.0);
  CHECK(bench.plant.commands[1].second.output == 25.0);
  REQUIRE(bench.plant.lines.size() == 2);
  CHECK(bench.plant.lines[0].old_value.empty());
  CHECK(bench.plant.lines[1].old_value.empty());
  CHECK(bench.write("output_scaled", {0x8000}) == Exception::illegal_value);
}

TEST_CASE("a write of the value in force is no command and no journal line", "[gateway][map]") {
  Bench bench;
  LoopReading& loop = bench.plant.readings[0];
  loop.settings.controller.pid.gains = {.kp = 0.1, .ki = 0.3, .kd = 0.0};
  const bool manual = GENERATE(false, true);
  loop.availability.mode = manual ? control::Mode::manual : control::Mode::automatic;
  const auto block = [&](std::uint32_t first, std::size_t count) {
    return bench.bank.write(Table::holding_register, static_cast<std::uint16_t>(first),
                            bench.read(Table::holding_register, first, count), kMaster);
  };
  const auto mode = static_cast<std::uint16_t>(manual ? 0 : 1);
  loop.row.requested_mode = loop.availability.mode;
  for (int second = 0; second < 3; ++second) {
    CHECK(bench.write("mode", {mode}) == Exception::none);
    CHECK(bench.write("sp", Bench::words_of(60.0F)) == Exception::none);
    CHECK(bench.write("sp_scaled", {6000}) == Exception::none);
    CHECK(bench.write("output", Bench::words_of(25.0F)) == Exception::none);
    CHECK(bench.write("output_scaled", {2500}) == Exception::none);
    CHECK(bench.write("kp", Bench::words_of(0.1F)) == Exception::none);
    CHECK(bench.write("ki", Bench::words_of(0.3F)) == Exception::none);
    CHECK(bench.write("kd", Bench::words_of(-0.0F)) == Exception::none);
    // The whole block of a loop as a master reads it: [mode, gap, sp, output, gains, scaled,
    // shelves].
    CHECK(block(32, 19) == Exception::none);
  }
  CHECK(bench.plant.commands.empty());
  CHECK(bench.plant.actions.empty());
  CHECK(bench.plant.lines.empty());
  if (!manual) return;
  CHECK(bench.write("sp", Bench::words_of(60.5F)) == Exception::busy);
  CHECK(bench.plant.lines.size() == 1);
}

TEST_CASE("in a block only the values that differ from those in force are commands",
          "[gateway][map]") {
  Bench bench;
  Words block = bench.read(Table::holding_register, 32, 14);
  const Words sp = Bench::words_of(61.0F);
  block[2] = sp[0];
  block[3] = sp[1];
  CHECK(bench.bank.write(Table::holding_register, 32, block, kMaster) == Exception::none);
  REQUIRE(bench.plant.commands.size() == 1);
  const rt::Command& order = bench.plant.commands[0].second;
  CHECK(order.set_point == 61.0);
  CHECK_FALSE((order.mode || order.output || order.kp || order.ki || order.kd));
  REQUIRE(bench.plant.lines.size() == 1);
  CHECK(bench.plant.lines[0].what == "sp");
}

TEST_CASE("in manual the output in force is the commanded one, which the device may round",
          "[gateway][map]") {
  Bench bench;
  LoopReading& loop = bench.plant.readings[0];
  loop.availability.mode = control::Mode::manual;
  loop.settings.controller.pid.tolerance = 0.02;
  loop.output_wanted = 33.333;
  loop.row.co = 33.32;
  CHECK(bench.write("output", Bench::words_of(33.333F)) == Exception::none);
  CHECK(bench.write("output", Bench::words_of(33.32F)) == Exception::none);  // as it reads
  CHECK(bench.write("output_scaled", {3332}) == Exception::none);
  CHECK(bench.plant.commands.empty());
  CHECK(bench.plant.lines.empty());
  // On its way to another output: a stop at this value is a command.
  loop.row.co = 20.0;
  CHECK(bench.write("output", Bench::words_of(20.0F)) == Exception::none);
  CHECK(bench.plant.commands.size() == 1);
  CHECK(bench.write("output", Bench::words_of(33.333F)) == Exception::none);
  CHECK(bench.plant.commands.size() == 1);
}

TEST_CASE("values that only the new mode keeps are commanded with it", "[gateway][map]") {
  Bench bench;
  LoopReading& loop = bench.plant.readings[0];
  Words words{1, 0};
  const Words sp = Bench::words_of(60.0F);
  words.insert(words.end(), sp.begin(), sp.end());
  SECTION("the set point that follows PV in manual, on the way to automatic") {
    loop.availability.mode = control::Mode::manual;
    CHECK(bench.write("mode", words) == Exception::none);
    REQUIRE(bench.plant.commands.size() == 1);
    CHECK(bench.plant.commands[0].second.set_point == 60.0);
  }
  SECTION("the output that the controller moves, on the way to manual") {
    words[0] = 0;
    const Words output = Bench::words_of(25.0F);
    words.insert(words.end(), output.begin(), output.end());
    CHECK(bench.write("mode", words) == Exception::none);
    REQUIRE(bench.plant.commands.size() == 1);
    CHECK(bench.plant.commands[0].second.output == 25.0);
    CHECK_FALSE(bench.plant.commands[0].second.set_point);
  }
}

TEST_CASE("one request with mode and output is judged by its own mode", "[gateway][map]") {
  Bench bench;
  const auto block = [](std::uint16_t mode, std::uint16_t gap, float sp, float output) {
    Words words{mode, gap};
    for (const float value : {sp, output}) {
      const Words two = Bench::words_of(value);
      words.insert(words.end(), two.begin(), two.end());
    }
    return words;
  };
  SECTION("manual, with the set point that is in force, and an output") {
    CHECK(bench.write("mode", block(0, 0, 60.0F, 30.0F)) == Exception::none);
    REQUIRE(bench.plant.commands.size() == 1);
    const rt::Command& order = bench.plant.commands[0].second;
    CHECK(order.mode == control::Mode::manual);
    CHECK(order.output == 30.0);
    CHECK_FALSE(order.set_point);
    REQUIRE(bench.plant.lines.size() == 2);
    CHECK(bench.plant.lines[0].what == "mode");
    CHECK(bench.plant.lines[1].what == "output");
  }
  SECTION("manual, with a set point that would follow PV: refused as a whole") {
    CHECK(bench.write("mode", block(0, 0, 55.0F, 30.0F)) == Exception::busy);
    CHECK(bench.plant.commands.empty());
    CHECK(bench.plant.lines.size() == 3);
  }
  SECTION("automatic from manual, with a set point and the present output") {
    bench.plant.readings[0].availability.mode = control::Mode::manual;
    CHECK(bench.write("mode", block(1, 0, 55.0F, 25.0F)) == Exception::none);
    REQUIRE(bench.plant.commands.size() == 1);
    CHECK(bench.plant.commands[0].second.mode == control::Mode::automatic);
    CHECK(bench.plant.commands[0].second.set_point == 55.0);
    CHECK_FALSE(bench.plant.commands[0].second.output);
  }
  SECTION("automatic, with another output: refused as a whole") {
    CHECK(bench.write("mode", block(1, 0, 55.0F, 30.0F)) == Exception::busy);
    CHECK(bench.plant.commands.empty());
  }
  SECTION("the gap between two fields accepts only the 0 that it reads, and not at an end") {
    CHECK(bench.write("mode", block(0, 1, 60.0F, 30.0F)) == Exception::illegal_address);
    CHECK(bench.write("mode", {0, 0}) == Exception::illegal_address);
    CHECK(bench.bank.write(Table::holding_register, 33, Words{0, 0x4270, 0}, kMaster) ==
          Exception::illegal_address);
    CHECK(bench.plant.commands.empty());
  }
}

TEST_CASE(
    "jacket and compensator have separate registers, in a block whose holding registers can't "
    "be "
    "written but for model_gap",
    "[gateway][map]") {
  Bench bench;
  record::RecordRow& row = bench.plant.readings[1].row;
  row.jacket_rate = -0.25F;
  row.jacket_rate_shadow = -0.5F;
  row.compensator = 1.5F;
  row.compensator_shadow = 2.0F;
  row.flags = record::kCompensatorActs;
  bench.plant.readings[1].orders_refused = 7;
  const Words block = bench.read(Table::holding_register, 32768 + 32, 32);
  const auto value = [&](std::size_t at) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(block[at]) << 16 | block[at + 1]);
  };
  CHECK(value(0) == -0.25F);
  CHECK(value(2) == -0.5F);
  CHECK(value(4) == 1.5F);
  CHECK(value(6) == 2.0F);
  CHECK(block[8] == 7);
  Words rest(23, 0);
  rest[1] = 7;        // alarm_model_gap: suppressed, no window has been judged
  rest[15] = 0x8000;  // explanation_gap_closed: not available
  CHECK(Words(block.begin() + 9, block.end()) == rest);
  // The old register belongs only to the jacket.
  CHECK(bench.number("jacket_rate", 1) == -0.25F);
  CHECK((bench.word("loop_bits", 1) & (16U | 64U)) == 64U);
  CHECK(bench.read(Table::coil, 32768, 8) == Words(8, 0));
  for (const std::uint16_t address : std::vector<std::uint16_t>{32768, 32778}) {
    CHECK(bench.bank.write(Table::holding_register, address, Words{0, 0}, kMaster) ==
          Exception::illegal_address);
  }
  Words beyond(1);
  CHECK(bench.bank.read(Table::holding_register, 32768 + 64, beyond) == Exception::illegal_address);
  CHECK(bench.bank.read(Table::coil, 32768 + 8, beyond) == Exception::illegal_address);
}

TEST_CASE("the newest explanation of a loop's alarm can be read", "[gateway][map]") {
  Bench bench;
  Explanation e;
  e.alarm = alarm::AlarmKind::stiction;
  e.final_name = alarm::AlarmKind::backlash;
  e.effect_number = 3;
  e.agrees = true;
  e.size_percent = 6.5;
  e.low_percent = 6.0;
  e.high_percent = 7.25;
  e.gap_closed = 0.9712;
  e.ended_ms = bench.plant.box().utc_ms - 70'000'000;
  bench.plant.readings[1].watch.explanation = std::make_shared<const Explanation>(e);
  const Words block = bench.read(Table::holding_register, 32768 + 32, 32);
  const auto value = [&](std::size_t at) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(block[at]) << 16 | block[at + 1]);
  };
  CHECK(block[16] == 3);
  CHECK(block[17] == 1);
  CHECK(value(18) == 6.5F);
  CHECK(value(20) == 6.0F);
  CHECK(value(22) == 7.25F);
  CHECK(block[24] == 9712);
  CHECK(block[25] == 2);
  CHECK((static_cast<std::uint32_t>(block[26]) << 16 | block[27]) == 70'000);
  e.agrees = false;
  bench.plant.readings[1].watch.explanation = std::make_shared<const Explanation>(e);
  CHECK(bench.read(Table::holding_register, 32768 + 32 + 17, 1) == Words{2});
}

TEST_CASE("a value out of its limits, half a value, or no number is refused without effect",
          "[gateway][map]") {
  Bench bench;
  CHECK(bench.write("sp", Bench::words_of(9.9F)) == Exception::illegal_value);
  CHECK(bench.write("sp", Bench::words_of(90.1F)) == Exception::illegal_value);
  CHECK(bench.write("sp", Bench::words_of(std::numeric_limits<float>::quiet_NaN())) ==
        Exception::illegal_value);
  CHECK(bench.write("sp", Bench::words_of(std::numeric_limits<float>::infinity())) ==
        Exception::illegal_value);
  CHECK(bench.write("sp", {0x4248}) == Exception::illegal_value);  // half a number
  CHECK(bench.write("output", Bench::words_of(-0.1F)) == Exception::illegal_value);
  CHECK(bench.write("output", Bench::words_of(100.1F)) == Exception::illegal_value);
  CHECK(bench.write("mode", {2}) == Exception::illegal_value);
  CHECK(bench.write("kp", Bench::words_of(-1.0F)) == Exception::illegal_value);
  CHECK(bench.write("sp_scaled", {9500}) == Exception::illegal_value);
  CHECK(bench.write("shelve_stiction", {481}) == Exception::illegal_value);
  // Only the other half.
  const auto at = static_cast<std::uint16_t>(bench.address(Table::holding_register, "sp", 0) + 1);
  CHECK(bench.bank.write(Table::holding_register, at, Words{0}, kMaster) ==
        Exception::illegal_value);
  CHECK(bench.plant.commands.empty());
  CHECK(bench.plant.actions.empty());
  for (const auto& line : bench.plant.lines) CHECK(line.result.find("refused") == 0);
}

TEST_CASE("a request is done as a whole or not at all", "[gateway][map]") {
  Bench bench;
  Words gains = Bench::words_of(0.5F);
  const Words ki = Bench::words_of(0.1F);
  const Words kd = Bench::words_of(-1.0F);  // not allowed
  gains.insert(gains.end(), ki.begin(), ki.end());
  SECTION("all are valid") {
    CHECK(bench.write("kp", gains) == Exception::none);
    REQUIRE(bench.plant.commands.size() == 1);
    CHECK(bench.plant.commands[0].second.kp == 0.5);
    CHECK(*bench.plant.commands[0].second.ki == Approx(0.1));
  }
  SECTION("one is not") {
    gains.insert(gains.end(), kd.begin(), kd.end());
    CHECK(bench.write("kp", gains) == Exception::illegal_value);
    CHECK(bench.plant.commands.empty());
  }
  SECTION("the mailbox has no room for all") {
    bench.plant.room = false;
    CHECK(bench.write("kp", gains) == Exception::busy);
    CHECK(bench.plant.commands.empty());
    CHECK(bench.plant.lines.size() == 2);
  }
}

TEST_CASE("the veto of a corrective action is a coil that keeps its written value",
          "[gateway][map]") {
  Bench bench;
  bench.plant.readings[1].watch.corrective = alarm::CorrectiveState::helping;
  CHECK(bench.read(Table::input_register, 64 + 64 + 62, 1) == Words{3});
  using Vetoes = std::vector<std::pair<std::size_t, bool>>;
  const auto veto = [&](std::uint16_t value) {
    CHECK(bench.write("veto_corrective_action", {value}, 1, Table::coil) == Exception::none);
  };
  // A master whose coil stays at 0 doesn't lift a person's veto.
  for (int second = 0; second < 3; ++second) veto(0);
  CHECK(bench.plant.vetoes.empty());
  veto(1);
  veto(1);
  CHECK(bench.plant.vetoes == Vetoes{{1, true}});
  veto(0);
  veto(0);
  CHECK(bench.plant.vetoes == Vetoes{{1, true}, {1, false}});
  CHECK(bench.plant.actions.empty());
  CHECK(bench.read(Table::coil, 16 + 16 + 15, 1) == Words{0});
  bench.plant.readings[1].watch.veto = alarm::Veto::back;
  CHECK(bench.read(Table::coil, 16 + 16 + 15, 1) == Words{1});
}

TEST_CASE("a register begins an offered corrective action, and another has its gain",
          "[gateway][map]") {
  Bench bench;
  const auto calm = [&](std::uint16_t value) {
    return bench.bank.write(Table::holding_register, 32768 + 32 + 9, Words{value}, kMaster);
  };
  using Begun = std::vector<std::size_t>;
  using alarm::CorrectiveState;
  auto& corrective = bench.plant.readings[1].watch.corrective;
  CHECK(calm(0) == Exception::none);
  CHECK(calm(1) == Exception::none);  // no proposal is pending
  CHECK(bench.plant.begun.empty());
  corrective = CorrectiveState::offered;
  CHECK(calm(0) == Exception::none);
  CHECK(bench.plant.begun.empty());
  // A master that writes it each second requests it once, and does not request a later offer.
  for (int second = 0; second < 60; ++second) {
    CHECK(calm(1) == Exception::none);
    if (second == 5) corrective = CorrectiveState::off;
    if (second == 20) corrective = CorrectiveState::offered;
    bench.plant.box_reading.uptime_s += 1.0;
  }
  CHECK(bench.plant.begun == Begun{1});
  bench.plant.box_reading.uptime_s += 30.0;
  CHECK(calm(1) == Exception::none);
  CHECK(bench.plant.begun == Begun{1, 1});
  CHECK(calm(0) == Exception::none);
  bench.plant.readings[1].watch.ordered = true;  // a person's command that is not yet taken
  CHECK(calm(1) == Exception::none);
  CHECK(calm(0) == Exception::none);
  bench.plant.readings[1].watch.ordered = false;
  CHECK(calm(1) == Exception::none);
  CHECK(bench.plant.begun == Begun{1, 1, 1});
  const auto gain = [&] { return bench.read(Table::holding_register, 32 + 32 + 19, 2); };
  CHECK(gain() == Words{0, 0});
  bench.plant.readings[1].moves =
      control::MovesState{.phase = control::MovePhase::resting, .gain = 0.237};
  CHECK(gain() == Words{3, 24});
}

TEST_CASE("operators' actions through coils and the shelf", "[gateway][map]") {
  using Action = alarm::AlarmAction;
  Bench bench;
  const auto coil = [&](const char* name, std::uint16_t value) {
    CHECK(bench.write(name, {value}, 1, Table::coil) == Exception::none);
  };
  coil("acknowledge_hysteresis", 0);  // a momentary coil that stays at 0
  CHECK(bench.plant.actions.empty());
  coil("acknowledge_hysteresis", 1);
  coil("reset_stiction", 1);
  coil("unshelve_unknown", 1);
  CHECK(bench.write("shelve_low_air_supply", {45}, 1) == Exception::none);
  CHECK(bench.write("shelve_low_air_supply", {0}, 1) == Exception::none);
  REQUIRE(bench.plant.actions.size() == 5);
  const auto& a = bench.plant.actions;
  for (const auto& [loop, order] : a) {
    CHECK(loop == 1);
    CHECK(order.peer == kMaster.name);
  }
  CHECK(a[0].second.kind == model_kind::hysteresis);
  CHECK(a[0].second.action == Action::acknowledge);
  CHECK(a[1].second.kind == model_kind::stiction);
  CHECK(a[1].second.action == Action::reset);
  CHECK(a[2].second.kind == model_kind::unknown);
  CHECK(a[2].second.action == Action::unshelve);
  CHECK(a[3].second.kind == model_kind::low_air_supply);
  CHECK(a[3].second.action == Action::shelve);
  CHECK(a[3].second.shelve_ms == 45 * 60'000);
  CHECK(a[4].second.action == Action::unshelve);
  CHECK(bench.read(Table::coil, 16, 15) == Words(15, 0));
}

TEST_CASE("a master that holds a shelf or a coil acts once, and one that holds 0 never",
          "[gateway][map]") {
  using Action = alarm::AlarmAction;
  Bench bench;
  const auto actions = [&] { return bench.plant.actions.size(); };
  const auto shelve = [&](std::uint16_t minutes, const Peer& peer = kMaster) {
    const auto at = bench.address(Table::holding_register, "shelve_stiction", 1);
    CHECK(bench.bank.write(Table::holding_register, static_cast<std::uint16_t>(at), Words{minutes},
                           peer) == Exception::none);
    bench.plant.box_reading.uptime_s += 1.0;
  };
  auto& alarms = bench.plant.readings[1].watch.alarms;
  const std::int64_t now_ms = bench.plant.box_reading.utc_ms;
  SECTION("zeros don't end a person's shelving") {
    REQUIRE(alarms.act(model_kind::stiction, Action::shelve, now_ms, now_ms + 3'600'000).accepted);
    for (int second = 0; second < 100; ++second) shelve(0);
    // The remaining time, read and written back, is no new shelving.
    shelve(60);
    bench.plant.box_reading.utc_ms += 5'000;
    shelve(60);
    bench.plant.box_reading.utc_ms += 60'000;
    shelve(60);
    CHECK(actions() == 0);
  }
  SECTION("repeated minutes are one shelving, and 0 ends it") {
    for (int second = 0; second < 100; ++second) shelve(45);
    CHECK(actions() == 1);
    shelve(0, {"10.0.0.8:7", true});  // another master, which holds 0
    CHECK(actions() == 1);
    shelve(0);
    shelve(0);
    REQUIRE(actions() == 2);
    CHECK(bench.plant.actions[1].second.action == Action::unshelve);
    shelve(45);
    CHECK(actions() == 3);
    bench.plant.box_reading.uptime_s += 30.0;
    shelve(45, {"10.0.0.7:2000", true});  // hours later, without a 0 between, after a reconnection
    CHECK(actions() == 4);
  }
  SECTION("a coil that is held acknowledges the present alarms, and no later ones") {
    for (int second = 0; second < 100; ++second) {
      CHECK(bench.write("acknowledge_stiction", {1}, 1, Table::coil) == Exception::none);
      CHECK(bench.bank.write(Table::coil, 0, Words{1}, kMaster) == Exception::none);
      bench.plant.box_reading.uptime_s += 1.0;
    }
    CHECK(actions() == 1);
    CHECK(bench.plant.acknowledged_by.size() == 1);
  }
}

TEST_CASE("acknowledge_all is one action, however many loops there are", "[gateway][map]") {
  Bench bench(3);
  CHECK(bench.bank.write(Table::coil, 0, Words{0}, kMaster) == Exception::none);
  CHECK(bench.plant.acknowledged_by.empty());
  CHECK(bench.bank.take_ticket() == 0);
  CHECK(bench.bank.write(Table::coil, 0, Words{1}, kMaster) == Exception::none);
  CHECK(bench.plant.acknowledged_by == std::vector{kMaster.name});
  CHECK(bench.plant.actions.empty());
}

TEST_CASE("a request with several commands waits for the last of them", "[gateway][map]") {
  Bench bench;
  const auto first =
      static_cast<std::uint16_t>(bench.address(Table::coil, "acknowledge_stiction", 0));
  CHECK(bench.bank.write(Table::coil, first, Words{1, 1, 1}, kMaster) == Exception::none);
  REQUIRE(bench.plant.newest_ticket == 3);
  CHECK(bench.bank.take_ticket() == 3);
  CHECK(bench.bank.take_ticket() == 0);
  // Writes that are no operator's command don't wait.
  CHECK(bench.bank.write(Table::holding_register, 0, Words{7}, kMaster) == Exception::none);
  CHECK(bench.bank.take_ticket() == 0);
}

TEST_CASE("process alarms are bits of the third block, acknowledged and unshelved together",
          "[gateway][map]") {
  using alarm::AlarmAction;
  Bench bench(2);
  auto& alarms = bench.plant.readings[1].watch.alarms;
  alarms.fit(model_kind::pv_high);
  const auto masks = [&] { return bench.read(Table::holding_register, 0x8000 + 32 + 28, 4); };
  CHECK(masks() == Words{0, 0, 0, 0});
  using Changes = std::vector<alarm::ProcessChange>;
  alarms.process_changed(1, Changes{{model_kind::output_lost, true}});
  alarms.process_changed(2,
                         Changes{{model_kind::not_normal_mode, true}, {model_kind::pv_high, true}});
  REQUIRE(alarms.act(model_kind::pv_high, AlarmAction::shelve, 3, 60'000).accepted);
  // 2 output_lost, 4 output_unknown and 8 not_normal_mode follow from it, 256 pv_high.
  CHECK(masks() == Words{2 + 8 + 256, 2, 256, 4 + 8});
  CHECK(bench.read(Table::holding_register, 0x8000 + 28, 4) == Words{0, 0, 0, 0});
  CHECK(bench.box_word("alarms_active") == 3);
  CHECK(bench.box_word("alarms_unacknowledged") == 1);
  CHECK(bench.box_word("alarms_shelved") == 1);

  CHECK(bench.bank.write(Table::coil, 0x8000 + 4 + 3, Words{1}, kMaster) == Exception::none);
  REQUIRE(bench.plant.actions.size() == 1);
  CHECK(bench.plant.actions[0].first == 1);
  CHECK(bench.plant.actions[0].second.kind == model_kind::output_lost);
  CHECK(bench.plant.actions[0].second.action == AlarmAction::acknowledge);
  CHECK(bench.bank.write(Table::holding_register, 0x8000 + 32 + 14, Words{2}, kMaster) ==
        Exception::illegal_value);
  CHECK(bench.bank.write(Table::holding_register, 0x8000 + 32 + 14, Words{1}, kMaster) ==
        Exception::none);
  REQUIRE(bench.plant.actions.size() == 2);
  CHECK(bench.plant.actions[1].second.kind == model_kind::pv_high);
  CHECK(bench.plant.actions[1].second.action == AlarmAction::unshelve);
  CHECK(bench.bank.write(Table::holding_register, 0x8000 + 32 + 28, Words{0}, kMaster) ==
        Exception::illegal_address);

  CHECK(bench.bank.write(Table::coil, 0, Words{1}, kMaster) == Exception::none);
  CHECK(bench.plant.acknowledged_kinds ==
        std::vector(alarm::kAlarmKinds.begin(), alarm::kAlarmKinds.end()));
}

TEST_CASE("the master's heartbeat is kept, shown, and not journalled", "[gateway][map]") {
  Bench bench;
  CHECK(bench.bank.write(Table::holding_register, 0, Words{777}, kMaster) == Exception::none);
  CHECK(bench.server.master_beat);
  CHECK(bench.box_word("master_heartbeat", Table::holding_register) == 777);
  CHECK(bench.plant.lines.empty());
}

TEST_CASE("a watched loop has no writable registers, alarms included", "[map][watch]") {
  Bench bench(3);
  bench.plant.watched = {1};
  for (const registers::Register& reg : registers::registers()) {
    if (!registers::writable(reg) || reg.area == registers::Area::box) continue;
    INFO(reg.name);
    const Words words(registers::width(reg), 0);
    const auto write = [&](std::size_t loop) {
      return bench.bank.write(reg.table, static_cast<std::uint16_t>(registers::address(reg, loop)),
                              words, kMaster);
    };
    CHECK(write(1) == Exception::illegal_address);
    CHECK(write(2) != Exception::illegal_address);
  }
  for (const auto& [loop, order] : bench.plant.commands) CHECK(loop == 2);
  for (const auto& [loop, action] : bench.plant.actions) CHECK(loop == 2);
  for (const auto& [loop, vetoed] : bench.plant.vetoes) CHECK(loop == 2);
}

TEST_CASE("in a loop that is being commissioned only manual can be written, and ends that",
          "[map]") {
  Bench bench(3);
  bench.plant.commissioned = {1};
  for (const registers::Register& reg : registers::registers()) {
    if (!registers::writable(reg) || reg.area == registers::Area::box) continue;
    INFO(reg.name);
    const Words words(registers::width(reg), reg.field == registers::Field::wanted_mode ? 1 : 0);
    CHECK(bench.bank.write(reg.table, static_cast<std::uint16_t>(registers::address(reg, 1)), words,
                           kMaster) == Exception::illegal_address);
  }
  CHECK(bench.plant.commands.empty());
  CHECK(bench.plant.commissioned.contains(1));
  // While manual is in force, repeating it takes no loop back from its commissioning.
  bench.plant.readings[1].availability.mode = control::Mode::manual;
  Words block{0, 0};
  for (const float value : {60.0F, 25.0F}) {
    const Words two = Bench::words_of(value);
    block.insert(block.end(), two.begin(), two.end());
  }
  for (int second = 0; second < 3; ++second) {
    CHECK(bench.write("mode", {0}, 1) == Exception::illegal_address);
    CHECK(bench.write("mode", block, 1) == Exception::illegal_address);
  }
  CHECK(bench.plant.commands.empty());
  CHECK(bench.plant.lines.empty());
  CHECK(bench.plant.commissioned.contains(1));
  bench.plant.readings[1].availability.mode = control::Mode::automatic;
  CHECK(bench.write("mode", {0}, 1) == Exception::none);
  REQUIRE(bench.plant.commands.size() == 1);
  CHECK(bench.plant.commands[0].second.mode == control::Mode::manual);
  CHECK_FALSE(bench.plant.commissioned.contains(1));
  CHECK(bench.write("sp", Bench::words_of(55.5F), 1) == Exception::none);
}

TEST_CASE("added or removed watched loops keep the registers of the controlled ones",
          "[map][watch]") {
  // In the order of the configuration: controlled here first.
  const auto registers_of_two = [](std::size_t loops) {
    Bench bench(loops);
    std::vector<Words> all;
    for (const registers::Register& reg : registers::registers()) {
      if (reg.area == registers::Area::box) continue;
      for (const std::size_t loop : {0U, 1U}) {
        all.push_back(bench.read(reg.table, registers::address(reg, loop), registers::width(reg)));
        all.push_back({static_cast<std::uint16_t>(registers::address(reg, loop))});
      }
    }
    return all;
  };
  const std::vector<Words> alone = registers_of_two(2);
  CHECK(alone.size() > 100);
  CHECK(registers_of_two(502) == alone);
  CHECK(registers_of_two(2000) == alone);
}

TEST_CASE("from loop 896 on there is no block, and the count shows this", "[map][watch]") {
  Bench bench(900);
  CHECK(bench.box_word("loop_count") == registers::kMostLoops);
  CHECK(registers::kMostLoops == 895);
  Words words(1);
  const auto read = [&](std::size_t loop) {
    return bench.bank.read(Table::holding_register, static_cast<std::uint16_t>(32768 + 32 * loop),
                           words);
  };
  CHECK(read(894) == Exception::none);
  CHECK(read(895) == Exception::illegal_address);
}

}  // namespace loopwarden::daemon::gateway::map_bank_test
