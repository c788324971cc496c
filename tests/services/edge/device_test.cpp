// SPDX-License-Identifier: Apache-2.0
#include "services/edge/device.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/support/property.hpp"

namespace device_test {

using namespace std::chrono_literals;
using namespace loopwarden::edge;
using loopwarden::sparkplug::DataType;
using loopwarden::sparkplug::Metric;
using loopwarden::sparkplug::Value;
namespace property = loopwarden::tests::property;

std::vector<MetricSpec> specs() {
  MetricSpec control{"Node Control/Rebirth", DataType::boolean, "", {}, {}, 0.0, false, false};
  MetricSpec pv{"pv", DataType::float32, "L/min", 0.0, 10.0, 0.5, false, true};
  MetricSpec travel{"travel", DataType::float32, "", {}, {}, 10.0, false, true};
  MetricSpec mode{"mode", DataType::uint16, "", {}, {}, 0.0, false, true};
  MetricSpec clock{"clock", DataType::uint32, "s", {}, {}, 0.0, true, true};
  return {control, pv, travel, mode, clock};
}

Reading reading(double pv, double travel, std::uint64_t mode, std::uint64_t clock) {
  return {{{false}, {pv}, {travel}, {mode}, {clock}}};
}

std::vector<std::string> names(const std::vector<Metric>& metrics) {
  std::vector<std::string> all;
  for (const Metric& m : metrics) all.push_back(m.name);
  return all;
}

using Names = std::vector<std::string>;

TEST_CASE("a birth has every metric with name, alias, type, unit and range", "[edge]") {
  Device device("d", specs(), 100);
  const auto birth = device.birth(reading(1.0, 2.0, 1, 5), 7);
  REQUIRE(birth.size() == 5);
  CHECK_FALSE(birth[0].alias);
  CHECK(birth[1].name == "pv");
  CHECK(birth[1].alias == 101);
  CHECK(birth[1].time_ms == 7);
  CHECK(birth[1].type == DataType::float32);
  CHECK(birth[1].value == Value(1.0));
  CHECK(birth[1].property("engUnit")->value == Value(std::string("L/min")));
  CHECK(birth[1].property("engLow")->value == Value(0.0));
  CHECK(birth[1].property("engHigh")->value == Value(10.0));
  CHECK(birth[1].property("Quality") == nullptr);
  CHECK(birth[2].properties.empty());
  CHECK(device.next_alias() == 105);
  CHECK(device.alias_of("pv") == 101);
  CHECK_FALSE(device.alias_of("Node Control/Rebirth"));
  CHECK_FALSE(device.alias_of("none"));
}

TEST_CASE("changes beyond the dead band are sent, and all changes of states", "[edge]") {
  Device device("d", specs(), 1);
  device.birth(reading(1.0, 100.0, 1, 0), 0);
  CHECK(device.changes(reading(1.05, 110.0, 1, 0), 1, 1h).empty());  // 0.5 % of 10; 10 % of 100
  CHECK(names(device.changes(reading(1.06, 100.0, 1, 0), 2, 1h)) == Names{"pv"});
  CHECK(names(device.changes(reading(1.06, 111.0, 0, 0), 3, 1h)) == Names{"travel", "mode"});
  CHECK(device.changes(reading(1.06, 111.0, 0, 0), 4, 1h).empty());
}

TEST_CASE("counters and clocks are sent once per interval, also after the clock was set back",
          "[edge]") {
  Device device("d", specs(), 1);
  device.birth(reading(1, 1, 1, 0), 100'000);
  CHECK(device.changes(reading(1, 1, 1, 1), 101'000, 60s).empty());
  CHECK(names(device.changes(reading(1, 1, 1, 2), 160'000, 60s)) == Names{"clock"});
  CHECK(device.changes(reading(1, 1, 1, 3), 161'000, 60s).empty());
  CHECK(names(device.changes(reading(1, 1, 1, 4), 50'000, 60s)) == Names{"clock"});
}

TEST_CASE("an unreliable value has Quality 0, and 192 when it is reliable again", "[edge]") {
  Device device("d", specs(), 1);
  device.birth(reading(1, 1, 1, 0), 0);
  Reading bad = reading(1, 1, 1, 0);
  bad.items[1].good = false;
  const auto lost = device.changes(bad, 1, 1h);
  REQUIRE(names(lost) == Names{"pv"});
  CHECK(lost[0].property("Quality")->value == Value(std::int64_t{0}));
  CHECK(lost[0].property("Quality")->type == DataType::int32);
  const auto back = device.changes(reading(1, 1, 1, 0), 2, 1h);
  REQUIRE(names(back) == Names{"pv"});
  CHECK(back[0].property("Quality")->value == Value(std::int64_t{192}));
  CHECK(device.birth(bad, 3)[1].property("Quality")->value == Value(std::int64_t{0}));
}

TEST_CASE("a value that becomes missing or valid is a change", "[edge]") {
  Device device("d", specs(), 1);
  device.birth(reading(1, 1, 1, 0), 0);
  Reading gone = reading(1, 1, 1, 0);
  gone.items[1].value = {};
  CHECK(names(device.changes(gone, 1, 1h)) == Names{"pv"});
  CHECK(names(device.changes(reading(1, 1, 1, 0), 2, 1h)) == Names{"pv"});
}

TEST_CASE("a command names a metric or gives its alias", "[edge]") {
  Device device("d", specs(), 100);
  Metric command;
  command.name = "mode";
  CHECK(device.meant_by(command)->name == "mode");
  command = {};
  command.alias = 101;
  CHECK(device.meant_by(command)->name == "pv");
  command.alias = 99;
  CHECK(device.meant_by(command) == nullptr);
  command.alias = 105;
  CHECK(device.meant_by(command) == nullptr);
  CHECK(device.meant_by(Metric{}) == nullptr);
}

TEST_CASE("a receiver of births and changes is never off by more than the dead band", "[edge]") {
  property::for_all("within the dead band", 100, [] {
    Device device("d", specs(), 1);
    std::map<std::string, Value> seen;
    const auto take = [&](const std::vector<Metric>& metrics) {
      for (const Metric& m : metrics) seen[m.name] = m.value;
    };
    double pv = property::number(0.0, 10.0);
    take(device.birth(reading(pv, 1, 1, 0), 0));
    for (std::uint64_t i = 1; i < 100; ++i) {
      pv = property::number(0.0, 10.0);
      const auto mode = static_cast<std::uint64_t>(property::one_of(3));
      take(device.changes(reading(pv, 1, mode, i), i * 1000, 60s));
      property::require(std::abs(std::get<double>(seen.at("pv")) - pv) <= 0.05 + 1e-12, "pv");
      property::require(seen.at("mode") == Value(mode), "mode");
    }
  });
}

}  // namespace device_test
