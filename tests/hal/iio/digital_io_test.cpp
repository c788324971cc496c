// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/digital_io.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/hal/iio/fake_gpio.hpp"

namespace digital_io_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeGpio;
using loopwarden::tests::FakeLine;

namespace {

constexpr std::int64_t kMs = 1'000'000;

struct Bench {
  std::shared_ptr<FakeGpio::Lines> lines = std::make_shared<FakeGpio::Lines>();
  FakeGpio gpio{lines};
  AnalogSettings settings;
  std::vector<AnalogEvent> events;
  DigitalIo io() {
    return DigitalIo(settings, "FIC-101", gpio,
                     [this](const AnalogEvent& event) { events.push_back(event); });
  }
  FakeLine& contact() {
    settings.enable = EnableSettings{.line = {.chip = "", .line = "enable"}, .debounce_s = 0.05};
    return (*lines)["enable"];
  }
  FakeLine& relay() {
    settings.alarm_relay = LineSettings{.chip = "", .line = "relay"};
    return (*lines)["relay"];
  }
  FakeLine& alive() {
    settings.alive = AliveSettings{.line = {.chip = "", .line = "alive"}, .half_period_s = 0.5};
    return (*lines)["alive"];
  }
};

}  // namespace

TEST_CASE("without lines no contact is fitted") {
  Bench bench;
  DigitalIo io = bench.io();
  io.open(0);
  io.step(1, true, false);
  CHECK(io.enable() == Enable::not_fitted);
}

TEST_CASE("the contact counts as it is at start, then after it has settled") {
  Bench bench;
  FakeLine& contact = bench.contact();
  contact.active = true;
  DigitalIo io = bench.io();
  CHECK(io.enable() == Enable::open);
  io.open(0);
  CHECK(io.enable() == Enable::closed);

  contact.active = false;
  io.step(100 * kMs, true, false);
  CHECK(io.enable() == Enable::closed);
  io.step(149 * kMs, true, false);
  CHECK(io.enable() == Enable::closed);
  io.step(150 * kMs, true, false);
  CHECK(io.enable() == Enable::open);

  contact.active = true;
  io.step(200 * kMs, true, false);
  CHECK(io.enable() == Enable::open);
  io.step(250 * kMs, true, false);
  CHECK(io.enable() == Enable::closed);
}

TEST_CASE("a bouncing contact keeps its state") {
  Bench bench;
  FakeLine& contact = bench.contact();
  contact.active = true;
  DigitalIo io = bench.io();
  io.open(0);
  for (int i = 1; i < 100; ++i) {
    contact.active = i % 2 == 0;
    io.step(i * 40 * kMs, true, false);
    REQUIRE(io.enable() == Enable::closed);
  }
}

TEST_CASE("a contact that can't be read is open") {
  Bench bench;
  FakeLine& contact = bench.contact();
  contact.active = true;
  contact.exists = false;
  DigitalIo io = bench.io();
  io.open(0);
  CHECK(io.enable() == Enable::open);
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events[0].text == "FIC-101 enable contact: no such line");
  contact.exists = true;
  io.step(999 * kMs, true, false);
  CHECK(io.enable() == Enable::open);
  io.step(1000 * kMs, true, false);
  CHECK(io.enable() == Enable::closed);
  contact.refuses = true;
  io.step(1001 * kMs, true, false);
  CHECK(io.enable() == Enable::open);
  contact.refuses = false;
  io.step(2001 * kMs, true, false);
  CHECK(io.enable() == Enable::closed);
  CHECK(bench.events.size() == 4);
}

TEST_CASE("the relay is energised only while the loop lives and has no alarm") {
  Bench bench;
  FakeLine& relay = bench.relay();
  relay.active = true;
  DigitalIo io = bench.io();
  io.open(0);
  CHECK_FALSE(relay.active);
  io.step(1, true, false);
  CHECK(relay.active);
  io.step(2, true, true);
  CHECK_FALSE(relay.active);
  io.step(3, true, false);
  CHECK(relay.active);
  io.step(4, false, false);
  CHECK_FALSE(relay.active);
  io.step(5, true, false);
  io.close();
  CHECK_FALSE(relay.active);
  CHECK_FALSE(relay.requested);
}

TEST_CASE("a relay line that was lost is driven again when it is back") {
  Bench bench;
  FakeLine& relay = bench.relay();
  DigitalIo io = bench.io();
  io.open(0);
  relay.refuses = true;
  io.step(1, true, false);
  CHECK_FALSE(relay.requested);
  relay.refuses = false;
  io.step(1000 * kMs + 1, true, false);
  CHECK(relay.active);
}

TEST_CASE(
    "the alive line changes every half period while the loop lives, otherwise it is constant") {
  Bench bench;
  FakeLine& alive = bench.alive();
  DigitalIo io = bench.io();
  io.open(0);
  CHECK_FALSE(alive.requested);  // the request may be an edge by itself
  for (int i = 0; i <= 1000; ++i) io.step(i * 10 * kMs, true, false);
  CHECK(alive.edges == 20);  // 10 s, the first after half a period
  for (int i = 1001; i <= 2000; ++i) io.step(i * 10 * kMs, false, false);
  CHECK(alive.edges == 20);
  // A loop in alarm is alive.
  for (int i = 2001; i <= 2100; ++i) io.step(i * 10 * kMs, true, true);
  CHECK(alive.edges == 22);
}

}  // namespace digital_io_test
