// SPDX-License-Identifier: Apache-2.0
// A loop as its engineers believe it to be: plain data, read from a model file by config/.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/control/loop_controller.hpp"
#include "model/effects/effect.hpp"
#include "model/effects/effect_spec.hpp"
#include "model/plant/process.hpp"
#include "model/plant/transmitter.hpp"

namespace loopwarden::plant {

struct ScheduledFault {
  effects::EffectSpec effect;
  effects::Block block = effects::Block::valve;
  effects::Schedule schedule;

  friend bool operator==(const ScheduledFault&, const ScheduledFault&) = default;
};

struct ProcessUncertainty {  // relative, what a fit may move without calling it an effect
  double gain = 0.03;
  double time_constant = 0.06;
  double dead_time = 0.03;

  friend bool operator==(const ProcessUncertainty&, const ProcessUncertainty&) = default;
};

// The load in a healthy record, PV units (watch/load_watch.hpp).
struct SeenLoad {
  double mean = 0.0;       // of PV less the twin's
  double deviation = 0.0;  // of its means over minutes
  double step = 0.0;       // the largest

  friend bool operator==(const SeenLoad&, const SeenLoad&) = default;
};

// How far a healthy record's CO is from what the twin's controller makes of SP and PV (watch/controller_watch.hpp).
struct SeenController {
  double rms = 0.0;         // CO units
  double resolution = 0.0;  // of CO, CO units

  friend bool operator==(const SeenController&, const SeenController&) = default;
};

// How sure a record is of the model's parameters: for training, and for what watches the loop.
struct TwinFit {
  std::vector<std::string> parameters;          // gain, time_constant, dead_time
  std::vector<std::vector<double>> covariance;  // of their natural logarithms
  // What the healthy record itself reaches of z (watch/twin_watch.hpp); 0: not known.
  double largest = 0.0;
  // Where its PV and CO were, in their units: elsewhere the twin is extrapolated.
  double seen_low = -std::numeric_limits<double>::infinity();
  double seen_high = std::numeric_limits<double>::infinity();
  double co_low = -std::numeric_limits<double>::infinity();
  double co_high = std::numeric_limits<double>::infinity();
  std::optional<SeenLoad> load{};
  std::optional<SeenController> controller{};

  friend bool operator==(const TwinFit&, const TwinFit&) = default;
};

struct Scenario {
  double duration_s = 300.0;                         // s
  std::vector<std::pair<double, double>> set_point;  // (s, PV units), first at 0
  std::vector<ScheduledFault> faults;
  std::uint64_t seed = 1;

  friend bool operator==(const Scenario&, const Scenario&) = default;
};

struct LoopModel {
  double sample_time_s = 0.1;  // s
  control::ControllerSettings controller;
  bool has_valve = true;  // else nothing that could stick: a heater, a pump, a drive
  std::vector<effects::EffectSpec> valve_effects;  // in the order in which CO meets them
  ProcessParameters process;
  std::vector<effects::EffectSpec> process_effects;
  ProcessUncertainty uncertainty;
  TransmitterParameters transmitter;
  std::vector<effects::EffectSpec> transmitter_effects;
  std::vector<effects::EffectSpec> disturbances;
  Scenario scenario;
  std::optional<TwinFit> twin;  // where it was commissioned

  friend bool operator==(const LoopModel&, const LoopModel&) = default;
};

// How long the loop goes on answering to a move of CO, s: lags and dead time; an integrating process settles as its
// controller lets it, in 1 / (gain kp).
double answer_s(const LoopModel& model) noexcept;

// Returns `model` with an ideal transmitter and without random disturbances.
LoopModel without_noise(LoopModel model);

}  // namespace loopwarden::plant
