// SPDX-License-Identifier: Apache-2.0
// The result in words, and the findings that need no fit of the plant.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/gap/controller.hpp"
#include "model/gap/reading.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// Other settings of the controller than those of the model.
FoundEffect describe_controller(const ControllerFinding& found, const control::PidGains& model);

// Properties of the transmitter that flat parts and spikes of PV show and the model lacks.
std::vector<FoundEffect> describe_reading(const ReadingFinding& reading,
                                          const plant::LoopModel& model);

// "s 0.9 CO units, j 0.3 CO units".
std::string parameters_text(const effects::EffectSpec& spec);

// A lead of `nats` in words.
const char* how_likely_without(double nats);

struct Summary {
  Outcome outcome = Outcome::no_gap;
  const std::vector<FoundEffect>& effects;
  const Misfit& before;
  const Misfit& after;
  double floor = 0.0;  // PV units
  const std::optional<Remainder>& remainder;
  std::vector<std::string> best{};  // names that the last third refutes
  bool closed_loop = false;
  bool plant_unexplained = false;  // the names explain nothing of the gap from CO to PV
  bool with_load = false;          // with an unmeasured disturbance
};
std::string sentence_of(const Summary& summary);

// (before - after)/(before - floor): closed share of the RMS error above the floor, -1 to 1. NaN if
// `before` is not above the floor.
double rms_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept;

}  // namespace loopwarden::gap
