// SPDX-License-Identifier: Apache-2.0
#include "model/twin/twin_diff.hpp"

#include <algorithm>
#include <cmath>

#include "model/twin/commission.hpp"
#include "model/effects/catalogue.hpp"

namespace loopwarden::twin {
namespace {

using plant::LoopModel;

double friction_percent(const LoopModel& model) {
  double most = 0.0;
  for (const effects::EffectSpec& spec : model.valve_effects) {
    const double size = size_percent(spec, model.controller.pid.output_span());
    if (size > most) most = size;
  }
  return most;
}

bool has_characteristic(const LoopModel& model) {
  return std::any_of(model.valve_effects.begin(), model.valve_effects.end(),
                     [](const auto& spec) { return spec.name == "valve_characteristic"; });
}

// PV at rest with the stem at `travel`, CO units.
double pv_at(const LoopModel& model, double travel) {
  const control::PidSettings& pid = model.controller.pid;
  double flow = travel;
  for (const effects::EffectSpec& spec : model.valve_effects) {
    if (spec.name != "valve_characteristic") continue;
    flow = effects::make_effect(spec, {.sample_time_s = model.sample_time_s,
                                       .output_low = pid.output_low,
                                       .output_high = pid.output_high})
               .reset(flow);
  }
  return model.process.level.value_or(0.0) + model.process.gain * flow;
}

double load_of(const LoopModel& model) {
  for (const effects::EffectSpec& spec : model.disturbances) {
    if (spec.name == "random_load") return spec.parameters.at("intensity");
  }
  return 0.0;
}

// Largest difference of PV at the same travel, % of the PV span.
double bent_percent(const LoopModel& before, const LoopModel& now) {
  constexpr int kPoints = 100;
  const control::PidSettings& pid = now.controller.pid;
  double most = 0.0;
  for (int i = 0; i <= kPoints; ++i) {
    const double travel = pid.output_low + now.controller.pid.output_span() * i / kPoints;
    const double pv = pv_at(now, travel);
    if (now.twin && (pv < now.twin->seen_low || pv > now.twin->seen_high)) continue;
    most = std::max(most, std::abs(pv - pv_at(before, travel)));
  }
  return 100.0 * most / now.transmitter.span();
}

}  // namespace

std::vector<Change> changes(const LoopModel& before, const LoopModel& now) {
  const plant::ProcessParameters& a = before.process;
  const plant::ProcessParameters& b = now.process;
  std::vector<Change> out;
  if (has_characteristic(before) || has_characteristic(now)) {
    out.push_back({"characteristic, change in % of PV span", 0.0, bent_percent(before, now)});
  } else {
    out.push_back({"gain, PV units/CO unit", a.gain, b.gain});
  }
  const auto lags = [](const plant::ProcessParameters& p) {
    return (p.integrating() ? 0.0 : p.time_constant_s) + p.second_time_constant_s;
  };
  out.push_back({"sum of the time constants, s", lags(a), lags(b)});
  out.push_back({"dead time, s", a.dead_time_s, b.dead_time_s});
  out.push_back(
      {"friction or backlash, % of CO span", friction_percent(before), friction_percent(now)});
  out.push_back({"noise, PV units", before.transmitter.noise, now.transmitter.noise});
  out.push_back({"disturbance, PV units per sqrt(s)", load_of(before), load_of(now)});
  out.push_back(
      {"kp, CO units/PV unit", before.controller.pid.gains.kp, now.controller.pid.gains.kp});
  out.push_back(
      {"ki, CO units/(PV unit s)", before.controller.pid.gains.ki, now.controller.pid.gains.ki});
  return out;
}

}  // namespace loopwarden::twin
