// SPDX-License-Identifier: Apache-2.0
#include "model/effects/valve_characteristic/valve_characteristic.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::valve_characteristic {
namespace {

struct Named {
  const char* name;
  ValveCharacteristic::Curve curve;
};
constexpr std::array kCurves{
    Named{"linear", ValveCharacteristic::Curve::linear},
    Named{"equal_percentage", ValveCharacteristic::Curve::equal_percentage},
    Named{"quick_opening", ValveCharacteristic::Curve::quick_opening},
    Named{"butterfly", ValveCharacteristic::Curve::butterfly},
    Named{"table", ValveCharacteristic::Curve::table}};

void check(const SpecReader& read, const EffectContext&) {
  check_curve(read, ValveCharacteristic::kMostPoints);
}

Effect make(const SpecReader& read, const EffectContext& context) {
  ValveCharacteristic::Parameters p;
  for (const Named& named : kCurves) {
    if (read.option("curve") == named.name) p.curve = named.curve;
  }
  p.rangeability = read.value("rangeability");
  p.point_count = read.spec().table.size();
  std::copy(read.spec().table.begin(), read.spec().table.end(), p.points.begin());
  return ValveCharacteristic(p, context.output_low, context.output_high);
}

// Returns a rising characteristic with the slope exp(bend h + swing h^2), h from -1/2 to 1/2. It is
// equal percentage without swing, quick opening with a negative bend, and S-shaped with swing.
EffectSpec bent(double bend, double swing, double low, double high) {
  constexpr int kPoints = 13;
  constexpr int kFine = 10;  // midpoint rule between points
  std::array<double, kPoints> flow{};
  for (int i = 1; i < kPoints; ++i) {
    flow[static_cast<std::size_t>(i)] = flow[static_cast<std::size_t>(i - 1)];
    for (int j = 0; j < kFine; ++j) {
      const double h = (i - 1 + (j + 0.5) / kFine) / (kPoints - 1) - 0.5;
      flow[static_cast<std::size_t>(i)] += std::exp(bend * h + swing * h * h);
    }
  }
  EffectSpec spec{"valve_characteristic", {}, {{"curve", "table"}}};
  for (int i = 0; i < kPoints; ++i) {
    spec.table.emplace_back(low + (high - low) * i / (kPoints - 1),
                            low + (high - low) * flow[static_cast<std::size_t>(i)] / flow.back());
  }
  return spec;
}

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  all.push_back(
      {.parameters = 1,
       .search = {{"rangeability", 1.2, 120.0, true, 5}},
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"valve_characteristic", {{"rangeability", v[0]}}, {{"curve", "equal_percentage"}}};
       },
       .shifts_pv = true});
  all.push_back({.spec = [](const Candidate&, Candidate::Values, Candidate::Values) -> EffectSpec {
    return {"valve_characteristic", {}, {{"curve", "quick_opening"}}};
  }});
  all.push_back({.spec = [](const Candidate&, Candidate::Values, Candidate::Values) -> EffectSpec {
    return {"valve_characteristic", {}, {{"curve", "butterfly"}}};
  }});
  all.push_back(
      {.parameters = 2,
       .search = {{"bend", -5.0, 5.0, false, 6}, {"swing", -12.0, 12.0, false, 3}},
       .spec = [](const Candidate& c, Candidate::Values v,
                  Candidate::Values) { return bent(v[0], v[1], c.output_low, c.output_high); },
       .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  OptionInfo curve{"curve", {}, "inherent characteristic"};
  for (const Named& named : kCurves) curve.values.push_back(named.name);
  return {
      .number = 5,
      .name = "valve_characteristic",
      .blocks = {Block::valve},
      .parameters = {optional(
          {"rangeability", "-", 1.0, true, 1e6, false, true, 0.0, "of equal_percentage"}, 30.0)},
      .options = {curve},
      .takes_table = true,
      .table = {"[[x, q], ...]", "travel and flow, CO units, both rising"},
      .header = "valve_characteristic/valve_characteristic.hpp",
      .check = check,
      .make = make,
      .candidates = candidates,
      .valve_rank = 5,
      .alarms = {"unknown"},
      .examples = {
          {"valve_characteristic",
           {"valve_characteristic", {{"rangeability", 30.0}}, {{"curve", "equal_percentage"}}},
           Block::valve}}};
}

}  // namespace loopwarden::effects::valve_characteristic
