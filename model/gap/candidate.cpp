// SPDX-License-Identifier: Apache-2.0
#include "model/gap/candidate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/control/root_sum_square.hpp"

namespace loopwarden::gap {

using plant::Block;
using plant::EffectSpec;

double SearchRange::value(double position) const noexcept {
  const double p = std::clamp(position, 0.0, 1.0);
  return logarithmic ? low * std::pow(high / low, p) : low + (high - low) * p;
}

double SearchRange::position(double value) const noexcept {
  const double v = std::clamp(value, low, high);
  return logarithmic ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
}

std::size_t Candidate::linear_columns() const noexcept {
  switch (kind) {
    case Kind::output_bias:
    case Kind::drift:
    case Kind::step_disturbance: return 1;
    case Kind::oscillating_disturbance: return 2;
    case Kind::stiction:
    case Kind::backlash:
    case Kind::hysteresis_width:
    case Kind::hysteresis_offset:
    case Kind::low_air_supply:
    case Kind::equal_percentage:
    case Kind::quick_opening:
    case Kind::butterfly:
    case Kind::curve_table:
    case Kind::cam_obstruction:
    case Kind::positioner_overshoot:
    case Kind::gain_change:  // the gain's own column stands for it
    case Kind::extra_dead_time:
    case Kind::extra_lag: break;
  }
  return 0;
}

namespace {

// Where a record leaves no room between the ends (a process as fast as the sampling), a little above
// the lower one.
SearchRange between(const char* name, double low, double high, bool logarithmic, int grid) {
  return {name, low, std::max(high, logarithmic ? 1.5 * low : low + 1e-6), logarithmic, grid};
}

}  // namespace

std::vector<Candidate> candidates(const SearchContext& c) {
  const double span = c.output_high - c.output_low;
  const double slow = c.time_constant_s + c.dead_time_s;  // s
  // A faster one is a healthy valve's own.
  const double slowest_healthy =
      std::min(1.2 / (kFastActuator * slow), 0.5 * std::numbers::pi / c.period_s);  // rad/s
  const SearchRange start{"start", -1.0, 1.0, false, 1};
  const double used = std::max(c.output_used_high - c.output_used_low, 0.02 * span);
  const double middle = (c.output_used_low + c.output_used_high) / 2.0;
  std::vector<Candidate> all{
      {Kind::stiction,
       "stiction",
       Block::valve,
       false,
       2,
       {{"s", 0.005 * span, 0.5 * span, true, 16},
        {"ratio", 0.0, 1.0, false, 5},
        {"start", -1.0, 1.0, false, 3}},
       true,
       4},
      {Kind::backlash,
       "backlash",
       Block::valve,
       false,
       1,
       {{"deadband", 0.005 * span, 0.5 * span, true, 10}, start},
       true},
      {Kind::hysteresis_width,
       "hysteresis",
       Block::valve,
       false,
       2,
       {{"width", 0.005 * span, 0.8 * span, true, 8}, {"knee", -4.0, 0.3, false, 4}, start},
       true},
      {Kind::hysteresis_offset,
       "hysteresis",
       Block::valve,
       false,
       1,
       {{"offset", 0.005 * span, 0.4 * span, true, 8}},
       false},
      {Kind::low_air_supply,
       "low_air_supply",
       Block::valve,
       false,
       3,
       {{"rate", 0.002 * span, 0.5 * span, true, 5},
        {"travel_limit", std::min(c.output_used_low + 0.2 * used, c.output_high - 0.02 * span),
         c.output_high, false, 4},
        between("lag", 0.2 * c.period_s, 2.0 * slow, true, 3)},
       false,
       4},
      {Kind::equal_percentage,
       "valve_characteristic",
       Block::valve,
       true,
       1,
       {{"rangeability", 1.2, 120.0, true, 5}},
       false},
      {Kind::quick_opening, "valve_characteristic", Block::valve, true, 0, {}, false},
      {Kind::butterfly, "valve_characteristic", Block::valve, true, 0, {}, false},
      {Kind::curve_table,
       "valve_characteristic",
       Block::valve,
       true,
       2,
       {{"bend", -5.0, 5.0, false, 6}, {"swing", -12.0, 12.0, false, 3}},
       false},
      {Kind::cam_obstruction,
       "cam_obstruction",
       Block::valve,
       false,
       3,
       {{"position", middle - 0.35 * used, middle + 0.35 * used, false, 5},
        {"band", 0.01 * span, 0.5 * span, true, 4},
        {"ratio", 0.6, 1.0, false, 2}},
       false},
      {Kind::positioner_overshoot,
       "positioner_overshoot",
       Block::valve,
       true,
       2,
       {{"damping", 0.05, 0.95, false, 3},
        between("natural_frequency", 0.1 / slow, slowest_healthy, true, 7)},
       false},
      {Kind::gain_change, "gain_change", Block::process, true, 1, {}, false},
      {Kind::extra_dead_time,
       "extra_dead_time",
       Block::process,
       true,
       1,
       {{"seconds", 0.0, 3.0 * slow, false, 9}},
       false},
      {Kind::extra_lag,
       "extra_lag",
       Block::process,
       true,
       1,
       {between("time_constant", 0.2 * c.period_s, 5.0 * slow, true, 7)},
       false},
      {Kind::output_bias, "output_bias", Block::transmitter, true, 1, {}, false},
      {Kind::drift, "drift", Block::transmitter, true, 1, {}, false},
      {Kind::oscillating_disturbance,
       "oscillating_disturbance",
       Block::disturbance,
       false,
       5,  // a frequency costs as much as three (Djuric 1996)
       {between("period", 4.0 * c.period_s, 0.5 * c.duration_s, true, 200)},
       false},
      {Kind::step_disturbance,
       "step_disturbance",
       Block::disturbance,
       false,
       3,  // a moment costs as much as two (Zhang and Siegmund 2007)
       {{"time", 0.02 * c.duration_s, 0.98 * c.duration_s, false, 100}},
       false},
  };
  for (Candidate& candidate : all) {
    candidate.output_low = c.output_low;
    candidate.output_high = c.output_high;
  }
  return all;
}

namespace {

// A characteristic whose slope is exp(bend h + swing h^2), h from -1/2 to 1/2: equal percentage without
// swing, quick opening with a negative bend, S-shaped with swing; always rising.
EffectSpec curve(double bend, double swing, double low, double high) {
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

}  // namespace

EffectSpec searched_spec(const Candidate& candidate, std::span<const double> v) {
  switch (candidate.kind) {
    case Kind::stiction: return {"stiction", {{"s", v[0]}, {"j", v[0] * v[1]}}};
    case Kind::backlash: return {"backlash", {{"deadband", v[0]}}};
    case Kind::hysteresis_width: return {"hysteresis", {{"width", v[0]}, {"knee", v[1]}}};
    case Kind::hysteresis_offset: return {"hysteresis", {{"offset", v[0]}}};
    case Kind::low_air_supply:
      return {"low_air_supply", {{"rate", v[0]}, {"travel_limit", v[1]}, {"lag", v[2]}}};
    case Kind::equal_percentage:
      return {"valve_characteristic", {{"rangeability", v[0]}}, {{"curve", "equal_percentage"}}};
    case Kind::quick_opening: return {"valve_characteristic", {}, {{"curve", "quick_opening"}}};
    case Kind::butterfly: return {"valve_characteristic", {}, {{"curve", "butterfly"}}};
    case Kind::curve_table: return curve(v[0], v[1], candidate.output_low, candidate.output_high);
    case Kind::cam_obstruction:
      return {"cam_obstruction", {{"position", v[0]}, {"band", v[1]}, {"jump", v[1] * v[2]}}};
    case Kind::positioner_overshoot:
      return {"positioner_overshoot", {{"damping", v[0]}, {"natural_frequency", v[1]}}};
    case Kind::extra_dead_time: return {"extra_dead_time", {{"seconds", v[0]}}};
    case Kind::extra_lag: return {"extra_lag", {{"time_constant", v[0]}}};
    case Kind::gain_change:
    case Kind::output_bias:
    case Kind::drift:
    case Kind::oscillating_disturbance:
    case Kind::step_disturbance: break;  // their sizes are solved for
  }
  return {};
}

EffectSpec complete_spec(const Candidate& candidate, std::span<const double> v,
                         std::span<const double> solved) {
  switch (candidate.kind) {
    case Kind::gain_change: return {"gain_change", {{"factor", solved[0]}}};
    case Kind::output_bias: return {"output_bias", {{"bias", solved[0]}}};
    case Kind::drift: return {"drift", {{"rate", solved[0]}}};
    case Kind::oscillating_disturbance:
      return {"oscillating_disturbance",
              {{"amplitude", control::root_sum_square(solved[0], solved[1])},
               {"period", v[0]},
               {"phase", std::atan2(solved[1], solved[0])}}};
    case Kind::step_disturbance: return {"step_disturbance", {{"size", solved[0]}, {"time", v[0]}}};
    case Kind::stiction:
    case Kind::backlash:
    case Kind::hysteresis_width:
    case Kind::hysteresis_offset:
    case Kind::low_air_supply:
    case Kind::equal_percentage:
    case Kind::quick_opening:
    case Kind::butterfly:
    case Kind::curve_table:
    case Kind::cam_obstruction:
    case Kind::positioner_overshoot:
    case Kind::extra_dead_time:
    case Kind::extra_lag: break;
  }
  return searched_spec(candidate, v);
}

bool is_friction(Kind kind) noexcept {
  return kind == Kind::stiction || kind == Kind::backlash || kind == Kind::hysteresis_width ||
         kind == Kind::hysteresis_offset || kind == Kind::cam_obstruction;
}

int valve_rank(std::string_view effect) noexcept {
  if (effect == "positioner_overshoot") return 0;
  if (effect == "positioner_lag") return 1;
  if (effect == "low_air_supply") return 2;
  if (effect == "stiction") return 3;
  if (effect == "valve_characteristic") return 5;
  return 4;
}

}  // namespace loopwarden::gap
