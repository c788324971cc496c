// SPDX-License-Identifier: Apache-2.0
#include "hal/feed/feed_table.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace feed_table_test {

using namespace loopwarden;
using namespace loopwarden::hal::feed;
using hal::Quality;
using hal::Reason;

namespace {

constexpr double kUtc = 1'764'000'000.0;

// A table with one loop, and with its own clock.
struct Rig {
  Rig() { source.read(inputs); }

  Feeder::Put put(const char* name, double value, double stamp_s, Quality quality = Quality::good) {
    return feeder.put(name, {.value = value, .quality = quality, .stamp_s = stamp_s},
                      {.now_ns = std::llround(now_s * 1e9), .utc_s = kUtc + now_s});
  }
  const hal::SourceSample& pv() {
    source.read(inputs);
    return inputs.process_variable;
  }
  double age_s() { return now_s - static_cast<double>(pv().sample.time_ns) * 1e-9; }

  FeedTable board;
  Feeder& feeder{board.feeder("opcua")};
  FeedSource source{{.process_variable = {{"opcua", "PV"}},
                     .output = {{"opcua", "OP"}},
                     .mode = hal::feed::FeedName{"opcua", "MODE"}},
                    board};
  hal::SourceInputs inputs;
  double now_s = 100.0;
};

constexpr double kNoStamp = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("a fed value arrives at the loop that asks for it", "[feed]") {
  Rig rig;
  CHECK(rig.pv().sample.quality == Quality::bad);
  CHECK(rig.pv().sample.reason == Reason::never_received);
  CHECK(rig.put("PV", 12.5, kNoStamp) == Feeder::Put::taken);
  CHECK(rig.pv().sample.value == 12.5);
  CHECK(rig.pv().sample.quality == Quality::good);
  CHECK(rig.age_s() == Approx(0.0).margin(1e-6));
  CHECK(rig.inputs.output.sample.reason == Reason::never_received);
  CHECK(rig.put("TEMPERATURE", 1.0, kNoStamp) == Feeder::Put::unknown_name);
  CHECK(rig.feeder.counters().values == 1);
  CHECK(rig.feeder.counters().unknown_names == 1);
}

TEST_CASE("quality is that of the source, and a bad one keeps the last good value's time",
          "[feed]") {
  Rig rig;
  rig.put("PV", 12.5, kNoStamp);
  rig.now_s += 3.0;
  rig.put("PV", kNoStamp, kNoStamp, Quality::bad);
  CHECK(rig.pv().sample.quality == Quality::bad);
  CHECK(rig.pv().sample.reason == Reason::source);
  CHECK(rig.age_s() == Approx(3.0));
  rig.put("PV", 12.0, kNoStamp, Quality::uncertain);
  CHECK(rig.pv().sample.quality == Quality::uncertain);
  rig.put("PV", std::numeric_limits<double>::infinity(), kNoStamp);
  CHECK(rig.pv().sample.reason == Reason::not_finite);
}

TEST_CASE("a raw value is scaled as its loop configures", "[feed]") {
  Rig rig;
  FeedSource raw{{.process_variable = {{"opcua", "PV"}, 0.5, -1.0}, .output = {{"opcua", "OP"}}},
                 rig.board};
  rig.put("PV", 12.5, kNoStamp);
  hal::SourceInputs inputs;
  raw.read(inputs);
  CHECK(inputs.process_variable.sample.value == 5.25);
  CHECK(rig.pv().sample.value == 12.5);
}

TEST_CASE("a word is a mode and no number", "[feed]") {
  Rig rig;
  const auto say = [&](const char* name, const char* word) {
    rig.feeder.put(name, {.value = hal::number_of_word(word), .is_word = true},
                   {.now_ns = 100'000'000'000, .utc_s = kUtc});
    rig.source.read(rig.inputs);
  };
  say("MODE", "AUTO");
  CHECK(rig.inputs.mode.sample.quality == Quality::good);
  CHECK(rig.inputs.mode.sample.value == hal::number_of_word("AUTO"));
  CHECK(rig.inputs.mode.sample.value > hal::kLargestNumber);
  CHECK(hal::number_of_word("AUTO") != hal::number_of_word("MAN"));
  CHECK(hal::number_of_word("3") == 3.0);
  say("PV", "12.5");
  CHECK(rig.inputs.process_variable.sample.quality == Quality::bad);
  CHECK(rig.inputs.process_variable.sample.reason == Reason::not_finite);
}

TEST_CASE("another clock's offset is measured, and a late value has its true age", "[feed]") {
  Rig rig;
  const double ahead_s = 3600.0;  // the source's clock
  for (int i = 0; i < 20; ++i, rig.now_s += 1.0) {
    rig.put("PV", i, kUtc + rig.now_s + ahead_s - 0.05);
    CHECK(rig.age_s() == Approx(0.0).margin(1e-3));
  }
  CHECK(rig.feeder.counters().clock_behind_s == Approx(0.05 - ahead_s));
  rig.now_s += 10.0;
  rig.feeder.lives(std::llround(rig.now_s * 1e9));
  rig.put("PV", 20.0, kUtc + rig.now_s + ahead_s - 8.05);
  CHECK(rig.age_s() == Approx(8.0).margin(1e-3));
  // The silence of such a source is also dated 8 s back.
  CHECK(static_cast<double>(rig.pv().alive_ns) * 1e-9 == Approx(rig.now_s - 8.0).margin(1e-3));
}

TEST_CASE("doubled values and those out of order are left out", "[feed]") {
  Rig rig;
  rig.put("PV", 1.0, 1000.0);
  CHECK(rig.put("PV", 1.0, 1000.0) == Feeder::Put::doubled);
  CHECK(rig.put("PV", 0.5, 999.0) == Feeder::Put::out_of_order);
  CHECK(rig.pv().sample.value == 1.0);
  CHECK(rig.put("PV", 1.0, 1000.0, Quality::bad) == Feeder::Put::taken);
  CHECK(rig.put("PV", 2.0, 1001.0) == Feeder::Put::taken);
  CHECK(rig.feeder.counters().doubled == 1);
  CHECK(rig.feeder.counters().out_of_order == 1);
}

TEST_CASE("a clock that is set back is followed within seconds", "[feed]") {
  Rig rig;
  double stamp_s = 50'000.0;
  for (int i = 0; i < 5; ++i, rig.now_s += 1.0, stamp_s += 1.0) rig.put("PV", i, stamp_s);
  stamp_s -= 3600.0;
  int left_out = 0;
  for (; rig.put("PV", 7.0, stamp_s) != Feeder::Put::taken; rig.now_s += 1.0, stamp_s += 1.0) {
    REQUIRE(++left_out < 15);
  }
  CHECK(left_out > 5);  // not at the first
  CHECK(rig.age_s() == Approx(0.0).margin(1e-3));
  rig.now_s += 1.0;
  CHECK(rig.put("PV", 8.0, stamp_s + 1.0) == Feeder::Put::taken);
  CHECK(rig.age_s() == Approx(0.0).margin(1e-3));
}

TEST_CASE("one stamp from the future does not silence a source", "[feed]") {
  Rig rig;
  rig.put("PV", 1.0, kUtc + rig.now_s);
  rig.now_s += 1.0;
  rig.put("PV", 2.0, kUtc + rig.now_s + 1e6);
  double gone_s = 0.0;
  for (; rig.put("PV", 3.0, kUtc + rig.now_s) != Feeder::Put::taken; rig.now_s += 1.0) {
    REQUIRE((gone_s += 1.0) < 15.0);
  }
  CHECK(rig.age_s() == Approx(0.0).margin(1e-3));
}

TEST_CASE("two loops may ask for one value", "[feed]") {
  Rig rig;
  FeedSource other{{.process_variable = {{"opcua", "X"}}, .output = {{"opcua", "PV"}}}, rig.board};
  rig.put("PV", 4.0, kNoStamp);
  hal::SourceInputs inputs;
  CHECK(rig.pv().sample.value == 4.0);
  other.read(inputs);
  CHECK(inputs.output.sample.value == 4.0);
}

}  // namespace feed_table_test
