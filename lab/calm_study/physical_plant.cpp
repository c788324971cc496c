// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/physical_plant.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/draw.hpp"

namespace loopwarden::lab {
namespace {

using hidden_cases::kStep_s;

constexpr double kLoadMemory_s = 300.0;

std::unique_ptr<hidden_cases::Element> stem_of(const PhysicalValve& valve) {
  hidden_cases::Stem stem{.static_friction = 0.5 * (valve.s + valve.j),
                          .dynamic_friction = 0.5 * (valve.s - valve.j),
                          .stribeck_per_s = 0.0,
                          .frequency_rad_s = valve.frequency_rad_s,
                          .damping_s = valve.damping_s,
                          .gripped = {}};
  if (valve.friction == PhysicalFriction::karnopp) return make_karnopp_stem(std::move(stem));
  stem.stribeck_per_s = valve.stribeck_per_s;
  return valve.friction == PhysicalFriction::stribeck
             ? make_karnopp_stem(std::move(stem))
             : make_lugre_stem(stem, valve.bristle_stiffness);
}

}  // namespace

PhysicalValve random_physical_valve(numeric::Random& random, double s, double j) {
  PhysicalValve valve{.s = s, .j = j};
  valve.friction = static_cast<PhysicalFriction>(std::min(2.0, 3.0 * random.uniform()));
  valve.air_lag_s = random.uniform(0.1, 0.5);
  valve.frequency_rad_s = random.uniform(15.0, 50.0);
  // A slip takes some tenths of a second and does not oscillate.
  valve.damping_s = std::max(numeric::log_uniform(random, 0.04, 0.2), 1.6 / valve.frequency_rad_s);
  valve.stribeck_per_s = valve.friction == PhysicalFriction::lugre ? random.uniform(0.02, 0.05)
                                                                   : random.uniform(0.005, 0.02);
  valve.bristle_stiffness = random.uniform(40.0, 100.0);
  return valve;
}

PhysicalPlant::PhysicalPlant(const plant::LoopModel& model, const PhysicalValve& valve)
    : gain_(model.process.gain),
      period_s_(model.sample_time_s),
      transmitter_(model.transmitter),
      random_(model.scenario.seed) {
  for (const effects::EffectSpec& one : model.disturbances) {
    if (one.name == "random_load") load_per_root_s_ = one.parameters.at("intensity");
  }
  valve_.push_back(hidden_cases::make_lag(valve.air_lag_s));
  valve_.push_back(stem_of(valve));
  process_.push_back(hidden_cases::make_dead_time(model.process.dead_time_s));
  process_.push_back(hidden_cases::make_lag(model.process.time_constant_s));
}

void PhysicalPlant::reset(double co) {
  samples_ = 0;
  stem_ = hidden_cases::reset(valve_, co);
  flow_ = gain_ * hidden_cases::reset(process_, stem_);
  load_ = 0.0;
  read();
}

void PhysicalPlant::step(double co) {
  const auto steps = static_cast<int>(std::lround(period_s_ / kStep_s));
  for (int i = 0; i < steps; ++i) {
    const double at_s = time_s() + i * kStep_s;
    stem_ = hidden_cases::step(valve_, co, at_s);
    flow_ = gain_ * hidden_cases::step(process_, stem_, at_s);
  }
  ++samples_;
  load_ = std::exp(-period_s_ / kLoadMemory_s) * load_ +
          load_per_root_s_ * std::sqrt(period_s_) * random_.normal();
  read();
}

void PhysicalPlant::read() {
  true_pv_ = flow_ + load_;
  const double seen = std::clamp(true_pv_ + transmitter_.noise * random_.normal(), transmitter_.low,
                                 transmitter_.high);
  pv_ = transmitter_.resolution > 0.0
            ? transmitter_.resolution * std::round(seen / transmitter_.resolution)
            : seen;
}

}  // namespace loopwarden::lab
