// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/replay_loop_io.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <memory>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace replay_loop_io_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::replay;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

namespace {

struct Bench {
  TemporaryFolder folder;
  ReplaySettings settings;
  std::unique_ptr<ReplayLoopIo> io;

  explicit Bench(const char* record) {
    settings.record = (folder / "r.csv").string();
    write_file(settings.record, record);
  }
  void open() {
    io = std::make_unique<ReplayLoopIo>(settings);
    io->open();
  }
  // Period 0 is the beginning of the loop, at any time in the daemon's life.
  Inputs read(std::uint64_t period) {
    Inputs inputs;
    io->read({.now_ns = now_ns(period), .period_index = 1000 + period}, inputs);
    return inputs;
  }
  static std::int64_t now_ns(std::uint64_t period) {
    return 7'000'000'000 + static_cast<std::int64_t>(period) * 100'000'000;
  }
  double write(double output, bool really = true) {
    return io->write({}, {.output = output, .time_ns = 0, .write = really, .alarm = false});
  }
};

constexpr const char* kRecord =
    "time,pv,sp,co,stem\n5,1,9,50,40\n5.1,2,9,51,41\n5.2,,9,52,\n5.3,4,9,53,43\n";

}  // namespace

TEST_CASE("each control period plays one row of the record") {
  Bench bench(kRecord);
  bench.open();
  const Inputs first = bench.read(0);
  CHECK(first.process_variable.value == 1.0);
  CHECK(first.process_variable.quality == Quality::good);
  CHECK(first.process_variable.reason == Reason::none);
  CHECK(first.process_variable.time_ns == Bench::now_ns(0));
  CHECK(first.process_variable.sequence == 1);
  CHECK(first.valve_position_fitted);
  CHECK(first.valve_position.value == 40.0);
  CHECK(first.enable == Enable::not_fitted);
  CHECK(first.output_ok);
  CHECK(bench.read(1).process_variable.value == 2.0);
  CHECK(bench.io->counters().transactions == 2);
  CHECK(bench.io->counters().connected);
}

TEST_CASE("an overrun skips the rows of the periods that were lost") {
  Bench bench(kRecord);
  bench.open();
  bench.read(0);
  CHECK(bench.read(3).process_variable.value == 4.0);
}

TEST_CASE("a missing sample is bad and leaves the last good one's time and sequence") {
  Bench bench(kRecord);
  bench.open();
  bench.read(0);
  bench.read(1);
  const Inputs missing = bench.read(2);
  CHECK(missing.process_variable.quality == Quality::bad);
  CHECK(missing.process_variable.reason == Reason::link_lost);
  CHECK(missing.process_variable.time_ns == Bench::now_ns(1));
  CHECK(missing.process_variable.sequence == 2);
  CHECK(missing.valve_position.quality == Quality::bad);
  CHECK(bench.read(3).process_variable.sequence == 3);
}

TEST_CASE("after the end all values are bad, with the reason") {
  Bench bench(kRecord);
  bench.open();
  bench.read(0);
  bench.read(3);
  for (const std::uint64_t period : {4U, 5U, 100U}) {
    const Inputs ended = bench.read(period);
    CHECK(ended.process_variable.quality == Quality::bad);
    CHECK(ended.process_variable.reason == Reason::end_of_record);
    CHECK(ended.process_variable.time_ns == Bench::now_ns(3));
    CHECK(ended.valve_position.reason == Reason::end_of_record);
  }
  CHECK_FALSE(bench.io->counters().connected);
}

TEST_CASE("a repeated record begins again at its end") {
  Bench bench(kRecord);
  bench.settings.repeat = true;
  bench.open();
  bench.read(0);
  CHECK(bench.read(3).process_variable.value == 4.0);
  CHECK(bench.read(4).process_variable.value == 1.0);
  CHECK(bench.read(9).process_variable.value == 2.0);
  CHECK(bench.read(9).process_variable.quality == Quality::good);
}

TEST_CASE("the read-back is the controller output if the record has no stem") {
  Bench with_co("time,pv,co\n0,1,50\n0.1,2,51\n");
  with_co.open();
  CHECK(with_co.read(0).valve_position_fitted);
  CHECK(with_co.read(1).valve_position.value == 51.0);
  Bench without("time,pv\n0,1\n0.1,2\n");
  without.open();
  CHECK_FALSE(without.read(0).valve_position_fitted);
}

TEST_CASE("commands are limited and quantised as by a real output") {
  Bench bench(kRecord);
  bench.settings.output_resolution = 0.5;
  bench.settings.output_low = 10.0;
  bench.settings.output_high = 20.2;
  bench.open();
  CHECK(bench.write(12.3) == 12.5);
  CHECK(bench.write(15.0, false) == 12.5);
  CHECK(bench.write(std::numeric_limits<double>::quiet_NaN()) == 12.5);
  CHECK(bench.write(12.2) == 12.0);
  CHECK(bench.write(-5.0) == 10.0);
  CHECK(bench.write(500.0) == 20.0);
  CHECK(bench.io->counters().writes == 4);
  std::string why;
  CHECK(bench.io->drive(11.3, std::chrono::milliseconds(0), why));
  CHECK(bench.write(0.0, false) == 11.5);
  CHECK_FALSE(bench.io->drive(std::nan(""), std::chrono::milliseconds(0), why));

  bench.settings.output_resolution = 0.0;
  bench.open();
  CHECK(bench.write(12.345) == 12.345);
  bench.settings.output_resolution = 0.3;
  bench.open();
  CHECK(bench.write(20.2) <= 20.2);
}

TEST_CASE("a record of another period, or an empty one, is refused") {
  Bench bench(kRecord);
  bench.settings.sample_time_s = 0.1005;
  CHECK_NOTHROW(bench.open());
  bench.settings.sample_time_s = 0.2;
  CHECK_THROWS_WITH(bench.open(), Catch::EndsWith("r.csv: its period is 0.1 s, the loop's sample "
                                                  "time 0.2 s"));
  bench.settings.record += ".absent";
  CHECK_THROWS_AS(bench.open(), loopwarden::record::RecordError);
}

TEST_CASE("before the record is open no value is good") {
  Bench bench(kRecord);
  bench.io = std::make_unique<ReplayLoopIo>(bench.settings);
  CHECK(bench.read(0).process_variable.quality == Quality::bad);
  CHECK_FALSE(bench.read(0).output_ok);
}

}  // namespace replay_loop_io_test
