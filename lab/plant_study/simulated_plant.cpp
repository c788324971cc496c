// SPDX-License-Identifier: Apache-2.0
#include "lab/plant_study/simulated_plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::lab {
namespace {

constexpr double kDay_s = 86400.0;

// Returns the period of the oscillation about the mean; 0: too few swings.
double swing_period_s(const std::vector<double>& x, double period_s) {
  const double mean = numeric::mean(x);
  double sum = 0.0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  const double band = 0.3 * std::sqrt(sum / static_cast<double>(x.size()));
  std::size_t crossings = 0;
  bool above = x.front() > mean;
  for (const double v : x) {
    if (above ? v < mean - band : v > mean + band) {
      above = !above;
      ++crossings;
    }
  }
  if (crossings < 20) return 0.0;
  return 2.0 * period_s * static_cast<double>(x.size()) / static_cast<double>(crossings);
}

const char* truth_of(double u) {
  if (u < 0.5) return "healthy";
  if (u < 0.65) return "stiction";
  if (u < 0.75) return "backlash";
  if (u < 0.85) return "tuning";
  return "follower";
}

}  // namespace

std::vector<SimulatedTag> simulate_unit(const PlantSettings& settings, std::size_t unit) {
  const std::size_t first = unit * settings.loops_a_unit;
  const std::size_t count = std::min(settings.loops_a_unit, settings.loops - first);
  const double duration_s = kDay_s * static_cast<double>(settings.days);
  std::vector<SimulatedTag> tags;
  double swing_s = 0.0;  // of the unit's last sticky loop
  for (std::size_t k = 0; k < count; ++k) {
    // Seeds are 100 apart, because each random effect of a loop uses the next seed.
    const std::uint64_t seed = settings.seed * 1000003 + 100 * (first + k);
    numeric::Random random(seed);
    const auto between = [&](double low, double high) {
      return low + (high - low) * random.uniform();
    };
    SimulatedTag tag{.tag = fmt::format("FIC{}{:02}", unit + 1, k + 1),
                     .truth = truth_of(random.uniform()),
                     .size = 0.0,
                     .pv = {},
                     .co = {},
                     .sp = {}};
    if (tag.truth == "follower" && swing_s == 0.0) tag.truth = "healthy";
    plant::LoopModel model;
    model.sample_time_s = settings.period_s;
    model.process = {.gain = between(0.6, 1.6),
                     .time_constant_s = settings.period_s * between(1.0, 5.0),
                     .dead_time_s = settings.period_s * between(0.5, 2.5)};
    model.transmitter = {.low = 0.0, .high = 100.0, .resolution = 0.0, .noise = between(0.05, 0.2)};
    // SIMC (Skogestad, J. Process Control 13 (2003)), from cautious to tight.
    const double closed_s = model.process.dead_time_s * between(1.0, 2.5);
    double kp = model.process.time_constant_s /
                (model.process.gain * (closed_s + model.process.dead_time_s));
    const double ti_s =
        std::min(model.process.time_constant_s, 4.0 * (closed_s + model.process.dead_time_s));
    double ki = kp / ti_s;
    if (tag.truth == "tuning") {
      kp *= between(1.6, 2.0);
      ki *= between(2.5, 3.5);
    }
    model.controller.pid.gains.kp = kp;
    model.controller.pid.gains.ki = ki;
    model.controller.pid.output_low = 0.0;
    model.controller.pid.output_high = 100.0;
    if (tag.truth == "stiction") {
      tag.size = between(2.0, 8.0);
      model.valve_effects = {{"stiction", {{"s", tag.size}, {"j", tag.size * between(0.2, 0.8)}}}};
    } else if (tag.truth == "backlash") {
      tag.size = between(2.0, 8.0);
      model.valve_effects = {{"backlash", {{"deadband", tag.size}}}};
    } else if (tag.truth == "follower") {
      model.disturbances = {
          {"oscillating_disturbance", {{"amplitude", between(0.5, 2.0)}, {"period", swing_s}}}};
    }
    model.disturbances.push_back(
        {"random_load",
         {{"intensity", between(0.01, 0.04)}, {"time_constant", between(600.0, 3000.0)}}});
    model.scenario.seed = seed;
    const double middle = model.process.gain * between(35.0, 65.0);
    double at_s = 0.0;
    while (at_s < duration_s) {
      model.scenario.set_point.emplace_back(at_s,
                                            std::clamp(middle + between(-5.0, 5.0), 5.0, 95.0));
      at_s += between(2.0, 10.0) * 3600.0;
    }
    plant::SimulatedLoop loop(model, 0.01);
    for (double t = 0.0; t < duration_s - 0.5 * settings.period_s; t += settings.period_s) {
      const plant::LoopSample sample = loop.step();
      tag.pv.push_back(sample.pv);
      tag.co.push_back(sample.co);
      tag.sp.push_back(sample.sp);
    }
    if (tag.truth == "stiction") {
      if (const double s = swing_period_s(tag.pv, settings.period_s); s > 0.0) swing_s = s;
    }
    tags.push_back(std::move(tag));
  }
  return tags;
}

}  // namespace loopwarden::lab
