// SPDX-License-Identifier: Apache-2.0
#include "lab/plant1/plant1_model.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "model/numeric/statistics.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::lab {
namespace {

using effects::EffectSpec;
using plant::LoopModel;

constexpr double kSetPoint = 5.0;                  // L/min
constexpr double kGain = 1.2264;                   // published, L/min / V
constexpr double kTimeConstant = 1.69376;          // published, s
constexpr double kDeadTime = 2.6256;               // published, s
constexpr double kProportional = 0.61145;          // V / (L/min), Ziegler-Nichols
constexpr double kIntegral = 0.070013;             // V / (L/min) / s, Ziegler-Nichols
constexpr double kFlowResolution = 10.0 / 4096.0;  // L/min
constexpr std::uint64_t kNoiseSeed = 1;
constexpr double kLeastJump = 0.1;        // of s: below it, stiction is the same law as backlash
constexpr std::size_t kRestSamples = 20;  // 2 s, shorter than the dead time

// Openings at which the characteristic has its points, V beyond the start of flow.
constexpr double kOpenings[] = {0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 5.0};
constexpr std::size_t kPoints = std::size(kOpenings);
constexpr double kClosedSlope = 1e-6;  // a table must rise; no measurable flow

// Order of the shared parameters.
enum Shared : std::size_t {
  kHalfBand,
  kRelayGain,
  kActuatorLag,
  kBreakaway,
  kFlowBegins,
  kLineDeadTime,
  kLineLag,
  kMeterLag,
  kFirstRise
};

EffectSpec effect(std::string name, std::map<std::string, double> parameters) {
  return {.name = std::move(name), .parameters = std::move(parameters)};
}

// Puts a valve effect in front of the positioner.
void before_positioner(LoopModel& model, EffectSpec spec) {
  model.valve_effects.insert(model.valve_effects.begin(), std::move(spec));
}

EffectSpec installed_characteristic(std::span<const double> shared) {
  EffectSpec spec = effect("valve_characteristic", {});
  spec.options["curve"] = "table";
  const double begins = shared[kFlowBegins];
  spec.table = {{0.0, 0.0}, {begins, kClosedSlope * begins}};
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double rise = shared[kFirstRise + i] / kGain;
    spec.table.emplace_back(begins + kOpenings[i], spec.table.back().second + rise + kClosedSlope);
  }
  return spec;
}

Plant1Candidate in_valve(std::string name, std::string label, std::vector<FitBound> bounds,
                         std::function<EffectSpec(std::span<const double>)> make) {
  return {std::move(name), std::move(label), std::move(bounds),
          [make = std::move(make)](std::span<const double> p, LoopModel& model) {
            before_positioner(model, make(p));
          }};
}

std::vector<Plant1Candidate> make_candidates() {
  using Span = std::span<const double>;
  std::vector<Plant1Candidate> all;
  all.push_back({"none", "none", {}, [](Span, LoopModel&) {}});
  all.push_back(in_valve("backlash", "backlash", {{"deadband", 0.0, 16.0}}, [](Span p) {
    return effect("backlash", {{"deadband", p[0]}});
  }));
  for (const char* law : {"choudhury", "he"}) {
    all.push_back(
        in_valve("stiction", std::string("stiction (") + law + ")",
                 {{"s", 0.0, 8.0}, {"j/s", kLeastJump, 1.0}}, [law](Span p) {
                   EffectSpec spec = effect("stiction", {{"s", p[0]}, {"j", p[0] * p[1]}});
                   spec.options["law"] = law;
                   return spec;
                 }));
  }
  all.push_back(
      in_valve("cam_obstruction", "cam_obstruction",
               {{"position", 0.0, 5.0}, {"band", 0.1, 7.0}, {"jump/band", 0.0, 1.0}}, [](Span p) {
                 return effect("cam_obstruction",
                               {{"position", p[0]}, {"band", p[1]}, {"jump", p[1] * p[2]}});
               }));
  all.push_back(in_valve("hysteresis", "hysteresis (offset)", {{"offset", 0.0, 2.0}}, [](Span p) {
    return effect("hysteresis", {{"offset", p[0]}});
  }));
  all.push_back(in_valve("hysteresis", "hysteresis (width)", {{"width", 0.0, 4.0}}, [](Span p) {
    return effect("hysteresis", {{"width", p[0]}});
  }));
  all.push_back(in_valve(
      "low_air_supply", "low_air_supply (rate)",
      {{"rate", 0.02, 10.0}, {"lag", 0.0, 5.0}, {"travel_limit", 1.0, 10.0}}, [](Span p) {
        return effect("low_air_supply", {{"rate", p[0]}, {"lag", p[1]}, {"travel_limit", p[2]}});
      }));
  all.push_back(in_valve(
      "low_air_supply", "low_air_supply (preload)", {{"preload", 0.0, 5.0}, {"lag", 0.0, 5.0}},
      [](Span p) {
        return effect("low_air_supply", {{"rate", 100.0}, {"preload", p[0]}, {"lag", p[1]}});
      }));
  all.push_back(in_valve(
      "positioner_overshoot", "positioner_overshoot",
      {{"damping", 0.05, 0.95}, {"natural_frequency", 0.3, 10.0}}, [](Span p) {
        return effect("positioner_overshoot", {{"damping", p[0]}, {"natural_frequency", p[1]}});
      }));
  const auto in_process = [&](const char* name, FitBound bound) {
    all.push_back({name, name, {bound}, [name, bound](Span p, LoopModel& model) {
                     model.process_effects.push_back(effect(name, {{bound.name, p[0]}}));
                   }});
  };
  in_process("gain_change", {"factor", 0.3, 3.0});
  in_process("extra_dead_time", {"seconds", 0.0, 5.0});
  in_process("extra_lag", {"time_constant", 0.0, 5.0});
  all.push_back({"output_bias", "output_bias", {{"bias", -3.0, 3.0}}, [](Span p, LoopModel& model) {
                   model.transmitter_effects.push_back(effect("output_bias", {{"bias", p[0]}}));
                 }});
  all.push_back({"drift", "drift", {{"rate", -0.05, 0.05}}, [](Span p, LoopModel& model) {
                   model.transmitter_effects.push_back(effect("drift", {{"rate", p[0]}}));
                 }});
  all.push_back(
      {"step_disturbance",
       "step_disturbance",
       {{"size", -3.0, 3.0}, {"time", 0.0, 96.0}},
       [](Span p, LoopModel& model) {
         model.disturbances.push_back(effect("step_disturbance", {{"size", p[0]}, {"time", p[1]}}));
       }});
  return all;
}

}  // namespace

Plant1Record plant1_record(std::string name, std::string condition, std::vector<double> pv) {
  Plant1Record record{.name = std::move(name), .condition = std::move(condition), .pv = {}};
  const std::span<const double> at_rest(pv.data(), kRestSamples);
  record.rest = numeric::mean(at_rest);
  record.noise = numeric::deviation(at_rest);
  record.variance = numeric::variance(pv);
  record.pv = std::move(pv);
  return record;
}

const std::vector<Plant1Candidate>& plant1_candidates() {
  static const std::vector<Plant1Candidate> all = make_candidates();
  return all;
}

const Plant1Candidate& plant1_candidate(const std::string& label) {
  for (const Plant1Candidate& c : plant1_candidates()) {
    if (c.label == label) return c;
  }
  throw std::logic_error("no candidate " + label);
}

const std::vector<FitBound>& plant1_shared_bounds() {
  static const std::vector<FitBound> bounds = [] {
    std::vector<FitBound> b{{"half dead band", 0.0, 1.4}, {"relay gain", 0.5, 60.0},
                            {"actuator lag", 0.02, 2.0},  {"breakaway", 0.0, 4.0},
                            {"flow begins at", 0.3, 3.0}, {"dead time", 0.3, 2.8},
                            {"line lag", 0.3, 2.5},       {"meter lag", 0.0, 2.0}};
    for (const double opening : kOpenings)
      b.push_back({fmt::format("rise to +{:g} V", opening), 0.0, 3.0});
    return b;
  }();
  return bounds;
}

const std::vector<FitBound>& plant1_own_bounds() {
  static const std::vector<FitBound> bounds{{"divisor", 1.0, 2.0}, {"step at", 0.0, 2.0}};
  return bounds;
}

LoopModel plant1_published(const Plant1Record& record, double divisor, double step_time_s) {
  LoopModel model;
  model.sample_time_s = kPlant1PeriodS;
  control::PidSettings& pid = model.controller.pid;
  pid.gains = {.kp = kProportional / divisor, .ki = kIntegral / divisor};
  pid.output_low = 0.0;
  pid.output_high = 10.0;
  model.controller.output.low = 0.0;
  model.controller.output.high = 10.0;
  model.process = {.gain = kGain, .time_constant_s = kTimeConstant, .dead_time_s = kDeadTime};
  model.transmitter = {
      .low = 0.0, .high = 10.0, .resolution = kFlowResolution, .noise = record.noise};
  model.transmitter_effects = {effect("output_bias", {{"bias", record.rest}})};
  model.scenario.set_point = {{0.0, 0.0}, {step_time_s, kSetPoint}};
  model.scenario.seed = kNoiseSeed;
  return model;
}

LoopModel plant1_corrected(const Plant1Record& record, std::span<const double> shared,
                           std::span<const double> own, const Plant1Candidate& candidate) {
  LoopModel model = plant1_published(record, own[0], own[1]);
  model.valve_effects = {effect("positioner", {{"dead_band", 2.0 * shared[kHalfBand]},
                                               {"gain", shared[kRelayGain]},
                                               {"lag", shared[kActuatorLag]},
                                               {"breakaway", shared[kBreakaway]}}),
                         installed_characteristic(shared)};
  model.process.time_constant_s = shared[kLineLag];
  model.process.dead_time_s = shared[kLineDeadTime];
  model.transmitter_effects.insert(model.transmitter_effects.begin(),
                                   effect("extra_lag", {{"time_constant", shared[kMeterLag]}}));
  candidate.add(own.subspan(plant1_own_bounds().size()), model);
  return model;
}

std::vector<double> plant1_run(const LoopModel& model, std::size_t samples) {
  plant::SimulatedLoop loop(model);
  std::vector<double> pv(samples);
  for (double& value : pv) value = loop.step().pv;
  return pv;
}

double misfit(const Plant1Record& record, std::span<const double> simulated) {
  double sum = 0.0;
  for (std::size_t k = 0; k < record.pv.size(); ++k) {
    const double difference = simulated[k] - record.pv[k];
    sum += difference * difference;
  }
  return sum / static_cast<double>(record.pv.size()) / record.variance;
}

double fit_percent(double misfit) { return 100.0 * (1.0 - std::sqrt(misfit)); }

}  // namespace loopwarden::lab
