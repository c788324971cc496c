// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_output.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/hal/iio/fake_iio.hpp"

namespace analog_output_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeIio;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

struct Bench {
  FakeIio iio;
  std::vector<AnalogEvent> events;
  AnalogOutputSettings settings;
  Bench() {
    settings.channel.device = "board";
    settings.channel.channel = "current0";
    settings.safe_ma = 3.5;
  }
  AnalogOutput output() {
    return AnalogOutput(iio.root(), settings, "FIC-101 output",
                        [this](const AnalogEvent& event) { events.push_back(event); });
  }
  std::string raw() const { return iio.get(0, "out_current0_raw"); }
};

}  // namespace

TEST_CASE("an output is written as the converter's raw number and read back") {
  Bench bench;
  bench.iio.add_board(0, "board");
  AnalogOutput output = bench.output();
  CHECK_FALSE(output.ok());
  CHECK_FALSE(output.stage());
  output.connect(0);
  CHECK(output.connected());
  CHECK_FALSE(output.ok());
  CHECK(output.reason() == Reason::never_received);
  REQUIRE(output.stage());
  CHECK(output.stage()->raw_for(50.0) == 2400);
  CHECK(bench.raw() == "0");  // connecting doesn't write
  CHECK(output.put(50.0, 0));
  CHECK(output.ok());
  CHECK(bench.raw() == "2400");
  CHECK(output.writes() == 1);
  CHECK(output.write_errors() == 0);
}

TEST_CASE("the safe current is put out as configured") {
  Bench bench;
  bench.iio.add_board(0, "board");
  CHECK(bench.output().put_safe(0));
  CHECK(bench.raw() == "700");
  bench.settings.safe_ma.reset();
  bench.iio.set(0, "out_current0_raw", "1234\n");
  AnalogOutput keeps = bench.output();
  CHECK(keeps.put_safe(0));
  CHECK(bench.raw() == "1234");
  CHECK(keeps.writes() == 0);
}

TEST_CASE("a converter that does not keep the written value is an error") {
  Bench bench;
  bench.iio.add_board(0, "board");
  bench.settings.lowest_ma = 0.0;
  fs::remove(bench.iio.device(0) / "out_current0_raw");
  // A file of the kernel that accepts decimal numbers and returns hexadecimal ones.
  fs::create_symlink("/proc/self/coredump_filter", bench.iio.device(0) / "out_current0_raw");
  AnalogOutput output = bench.output();
  CHECK(output.put(-25.0, 0));  // 0 mA
  CHECK_FALSE(output.put(50.0, 1));
  CHECK(output.reason() == Reason::device_error);
  REQUIRE(bench.events.size() == 1);
  CHECK_THAT(bench.events[0].text, Catch::Contains("2400 was written, "));
  CHECK(output.put(-25.0, 2));
  CHECK(output.ok());
}

TEST_CASE("a converter that delivers no number is an error") {
  Bench bench;
  bench.iio.add_board(0, "board");
  fs::remove(bench.iio.device(0) / "out_current0_raw");
  // Takes every write, delivers no current.
  fs::create_symlink("/dev/null", bench.iio.device(0) / "out_current0_raw");
  AnalogOutput output = bench.output();
  CHECK_FALSE(output.put(50.0, 0));
  CHECK_FALSE(output.ok());
  CHECK(output.reason() == Reason::device_error);
  CHECK(output.write_errors() == 1);
  CHECK_FALSE(output.connected());
}

TEST_CASE("a refused write shows until one succeeds") {
  Bench bench;
  bench.iio.add_board(0, "board");
  fs::rename(bench.iio.device(0) / "out_current0_raw", bench.iio.root() / "kept");
  fs::create_symlink("/dev/full", bench.iio.device(0) / "out_current0_raw");
  {
    AnalogOutput output = bench.output();
    CHECK_FALSE(output.put(50.0, 0));
    CHECK_FALSE(output.put(51.0, 1));
    CHECK(output.reason() == Reason::device_error);
    CHECK(output.counters().device_errors == 2);
    REQUIRE(bench.events.size() == 1);
    CHECK_THAT(bench.events[0].text, Catch::Contains("out_current0_raw: can't be written"));
  }
}

TEST_CASE("an absent converter is probed once a second and accepts commands when it appears") {
  Bench bench;
  AnalogOutput output = bench.output();
  output.connect(0);
  CHECK(output.reason() == Reason::never_received);
  CHECK_FALSE(output.put(50.0, 0));
  CHECK(output.reason() == Reason::link_lost);
  bench.iio.add_board(0, "board");
  CHECK_FALSE(output.put(50.0, kSecond - 1));
  CHECK(bench.raw() == "0");
  CHECK(output.put(50.0, kSecond));
  CHECK(bench.raw() == "2400");
  CHECK(output.ok());
}

TEST_CASE("a converter that reaches no permitted current is refused in words") {
  Bench bench;
  bench.iio.add_board(0, "board");
  bench.iio.set(0, "out_current_scale", "1000\n");
  AnalogOutput output = bench.output();
  CHECK_FALSE(output.put(50.0, 0));
  REQUIRE(bench.events.size() == 1);
  CHECK_THAT(bench.events[0].text, Catch::Contains("no raw number from 0 to 4095"));
}

}  // namespace analog_output_test
