// SPDX-License-Identifier: Apache-2.0
#include "workbench/compare/compare_cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "model/analysis/tuning_rules.hpp"

namespace loopwarden::workbench {
namespace {

using control::CompensatorKind;
using control::JacketForm;

constexpr std::array kSetPoints{0.50, 0.52, 0.60, 0.55};  // share of the PV range
constexpr std::array kSizes{2.0, 5.0, 10.0};              // % of the CO range

effects::EffectSpec effect(const char* name, std::map<std::string, double> parameters) {
  return {.name = name, .parameters = std::move(parameters)};
}

double co_span(const plant::LoopModel& model) { return model.controller.pid.output_span(); }

std::vector<std::pair<std::string, std::vector<effects::EffectSpec>>> faults_of(double size) {
  return {{"stiction, J = 0.3 S", {effect("stiction", {{"s", size}, {"j", 0.3 * size}})}},
          {"stiction, J = S", {effect("stiction", {{"s", size}, {"j", size}})}},
          {"backlash", {effect("backlash", {{"deadband", size}})}},
          {"hysteresis", {effect("hysteresis", {{"width", size}})}}};
}

// Returns the ratio J / S that the compensators receive. For faults without stiction it is a guess.
double jump_share(const std::string& fault) { return fault == "stiction, J = S" ? 1.0 : 0.3; }

struct PlantVariant {
  std::string name;
  double lag = 1.0;  // factors
  double dead = 1.0;
};

}  // namespace

std::vector<CompareCase> compare_cases(const plant::LoopModel& model, ComparedPlants plants) {
  std::vector<CompareCase> cases;
  const double pv_span = model.transmitter.span();
  for (const PlantVariant& variant :
       {PlantVariant{"own", 1.0, 1.0}, PlantVariant{"lag x 4", 4.0, 1.0},
        PlantVariant{"dead time x 2", 1.0, 2.0}}) {
    if (plants == ComparedPlants::own && variant.name != "own") continue;
    plant::LoopModel plant = model;
    plant.scenario.faults.clear();
    plant.valve_effects.clear();
    plant.controller.jacket = {};
    plant.controller.compensator = {};
    plant.process.time_constant_s *= variant.lag;
    plant.process.dead_time_s *= variant.dead;
    if (variant.lag != 1.0 || variant.dead != 1.0) {
      // The lambda rule has no setting for a process without dead time. Any setting is fast enough.
      const auto gains = analysis::tune(analysis::TuningRule::lambda, plant.process, {});
      if (!gains) continue;
      plant.controller.pid.gains = *gains;
    }
    // Whole samples, so that set points change at the samples that the measures expect.
    const double wanted_s = 350.0 * plant::answer_s(plant);
    const double hold_s = std::round(wanted_s / plant.sample_time_s) * plant.sample_time_s;
    plant.scenario.set_point.clear();
    for (std::size_t i = 0; i < kSetPoints.size(); ++i) {
      plant.scenario.set_point.emplace_back(static_cast<double>(i) * hold_s,
                                            model.transmitter.low + kSetPoints[i] * pv_span);
    }
    for (const double noise : {0.0, 0.001 * pv_span}) {
      plant.transmitter.noise = noise;
      const auto add = [&](const std::string& fault, double percent,
                           std::vector<effects::EffectSpec> effects) {
        CompareCase one{fault, percent, variant.name, noise, plant, hold_s};
        one.model.valve_effects = std::move(effects);
        cases.push_back(std::move(one));
      };
      add("no fault", 0.0, {});
      for (const double percent : kSizes) {
        for (auto& [name, effects] : faults_of(percent / 100.0 * co_span(model))) {
          add(name, percent, std::move(effects));
        }
      }
    }
  }
  return cases;
}

std::vector<Contender> contenders(const CompareCase& one, double estimate) {
  const double span = co_span(one.model);
  // On a healthy valve the compensators are set for a fault of 5 %.
  const double true_size = (one.percent > 0.0 ? one.percent : 5.0) / 100.0 * span;
  const double size = estimate * true_size;
  const plant::ProcessParameters& p = one.model.process;
  const double answer = plant::answer_s(one.model);  // s
  // Four standard deviations of CO due to noise.
  const double band = 4.0 * one.noise * one.model.controller.pid.gains.kp + 1e-3 * size;
  const auto jacket = [&](JacketForm form) {
    return [form, span](control::ControllerSettings& c) {
      c.jacket = {.form = form, .gain_per_s = 1.0, .dead_zone = 0.003 * span};
    };
  };
  const auto adding = [](control::CompensatorSettings settings) {
    return [settings](control::ControllerSettings& c) { c.compensator = settings; };
  };
  const double pulse = std::max(5.0 * one.model.sample_time_s, answer / 4.0);
  return {
      {"none", [](control::ControllerSettings&) {}},
      {"jacket dwell", jacket(JacketForm::dwell)},
      {"jacket bounded", jacket(JacketForm::bounded)},
      {"jacket paper", jacket(JacketForm::paper)},
      {"knocker", adding({.kind = CompensatorKind::knocker,
                          .amplitude = size / 2.0,
                          .pulse_period_s = pulse,
                          .pulse_width_s = 0.4 * pulse})},
      {"two-move", adding({.kind = CompensatorKind::two_move,
                           .stick_band = size,
                           .move_time_s = answer,
                           .max_mean_error = std::abs(p.gain) * size,
                           .mean_error_time_s = 20.0 * answer})},
      {"reinforcement",
       adding(
           {.kind = CompensatorKind::reinforcement, .amplitude = size / 2.0, .noise_band = band})},
      {"backlash", adding({.kind = CompensatorKind::backlash, .gap = size, .noise_band = band})},
      {"planned moves", adding({.kind = CompensatorKind::planned_moves,
                                .planned = {.gain = p.gain,
                                            .time_constant_s = p.time_constant_s,
                                            .dead_time_s = p.dead_time_s,
                                            .s = size,
                                            .j = jump_share(one.fault) * size}})},
      {"hysteresis",
       adding({.kind = CompensatorKind::hysteresis, .width = size, .noise_band = band})},
  };
}

CompareResult compare_one(const CompareCase& one, const Contender& contender) {
  plant::LoopModel model = one.model;
  contender.fit(model.controller);
  const auto count = static_cast<double>(kSetPoints.size());
  const analysis::SimulatedRecord r = analysis::run_model(model, count * one.hold_s);
  const double h = model.sample_time_s;
  const auto hold = static_cast<std::size_t>(std::lround(one.hold_s / h));
  CompareResult result;
  double squares = 0.0;
  double cycling = 0.0;
  for (std::size_t i = 0; i < kSetPoints.size(); ++i) {
    const std::size_t from = i * hold + hold / 3;
    const std::size_t length = hold - hold / 3;
    const auto part = [&](const std::vector<double>& column) {
      return std::span(column).subspan(from, length);
    };
    const analysis::LoopMetrics m =
        analysis::loop_metrics(part(r.sp), part(r.true_pv), part(r.stem), h, 0.0);
    squares += m.rms_error * m.rms_error / count;
    result.amplitude += m.amplitude / count;
    result.mean_error += std::abs(m.mean_error) / count;
    result.travel_per_hour += m.travel_per_hour / count;
    result.reversals_per_hour += m.reversals_per_hour / count;
    if (m.period_s > 0.0) {
      result.period_s += m.period_s;
      cycling += 1.0;
    }
    if (i == 0) continue;
    const double before = model.scenario.set_point[i - 1].second;
    const double after = model.scenario.set_point[i].second;
    double beyond = 0.0;
    // Starts one sample later, because rounding may delay the change by one sample.
    for (std::size_t k = i * hold + 1; k < (i + 1) * hold; ++k) {
      beyond = std::max(beyond, (r.true_pv[k] - after) / (after - before));
    }
    result.overshoot += beyond / (count - 1.0);
  }
  result.variability = std::sqrt(squares);
  if (cycling > 0.0) result.period_s /= cycling;
  for (std::size_t k = 0; k < r.sp.size(); ++k) {
    result.absolute_error += std::abs(r.sp[k] - r.true_pv[k]) * h;
  }
  return result;
}

}  // namespace loopwarden::workbench
