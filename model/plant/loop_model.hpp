// SPDX-License-Identifier: Apache-2.0
// The model of a loop as its engineers believe it to be: plain data that config/ reads from a model
// file.
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

// Relative uncertainty of the process: a fit can change it by this much without reporting an
// effect.
struct ProcessUncertainty {
  double gain = 0.03;
  double time_constant = 0.06;
  double dead_time = 0.03;

  friend bool operator==(const ProcessUncertainty&, const ProcessUncertainty&) = default;
};

// The disturbance in a healthy record, PV units (watch/load_watch.hpp).
struct SeenLoad {
  double mean = 0.0;       // mean of PV minus PV of the twin
  double deviation = 0.0;  // standard deviation of its means over minutes
  double step = 0.0;       // its largest step

  friend bool operator==(const SeenLoad&, const SeenLoad&) = default;
};

// The difference between CO of a healthy record and CO of the twin's controller for the same SP and
// PV (watch/controller_watch.hpp).
struct SeenController {
  double rms = 0.0;         // CO units
  double resolution = 0.0;  // resolution of CO, CO units

  friend bool operator==(const SeenController&, const SeenController&) = default;
};

// The confidence of a model that was fitted to a healthy record, for training and for the
// monitoring.
struct TwinFit {
  std::vector<std::string> parameters;          // gain, time_constant, dead_time
  std::vector<std::vector<double>> covariance;  // of their natural logarithms
  // The largest z of the healthy record itself (watch/twin_watch.hpp); 0: unknown.
  double largest = 0.0;
  // The ranges of PV and CO in the record, in their units. Outside them the twin extrapolates.
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
  bool has_valve = true;  // false: a heater, a pump or a drive, which can't stick
  std::vector<effects::EffectSpec> valve_effects;  // in the order in which CO meets them
  ProcessParameters process;
  std::vector<effects::EffectSpec> process_effects;
  ProcessUncertainty uncertainty;
  TransmitterParameters transmitter;
  std::vector<effects::EffectSpec> transmitter_effects;
  std::vector<effects::EffectSpec> disturbances;
  Scenario scenario;
  std::optional<TwinFit> twin;  // present if the model was commissioned

  friend bool operator==(const LoopModel&, const LoopModel&) = default;
};

// Returns the duration of the response to a move of CO, s: lags plus dead time. An integrating
// process counts with the settling by its controller, 1 / (gain kp).
double answer_s(const LoopModel& model) noexcept;

// Returns `model` with an ideal transmitter and without random disturbances.
LoopModel without_noise(LoopModel model);

}  // namespace loopwarden::plant
