// SPDX-License-Identifier: Apache-2.0
// Simulated windows with a condition of random severity: the training data of the specialists.
//
// Each window is drawn from its own seed. Gain, time constant and dead time are within twice the
// model's uncertainty. Also drawn are a second lag and a lag of the actuator, tuning, healthy
// friction, noise, sometimes a random load, and the moves of the set point. The condition has
// existed for a long time, and the window starts at a random moment. Each fault uses every law that
// model/plant has for it.
//
//   severity    s, dead band, width: log-uniform, least_percent to 20 % of the CO span; offset to
//               12 %; fill rate log-uniform, 0.5 to 5 % of the CO span per second
//   tuning      gains times exp(uniform(-0.7, 0.2))
//   noise       log-uniform, 0.03 to 0.4 % of the PV span
//   set point   steps 60 %, square wave 15 %, ramps and waves 13 %, constant 12 % of the windows
//   other       one of other_names(), with its sizes in simulated_windows.cpp
//
// With a twin (plant::TwinFit), measured values replace these ranges. The process is drawn from its
// covariance and its uncertainty, noise within a quarter of the twin's, tuning within a fifth. Load
// and friction are the twin's own, friction only if it has any. Two of three windows have the
// set-point moves of its scenario.
//
// Errors: std::invalid_argument for a name that is not in other_names(); effects::EffectError for a
// model that can't be simulated.
// Limits: one fault per window, present throughout; only valves with the laws of model/plant.
//
// Source: the ranges are our own choice for typical plants. The figures of
// docs/explanation/accuracy.md apply to them.
#pragma once

#include <cstdint>
#include <vector>

#include "model/numeric/loop_record.hpp"
#include "model/plant/loop_model.hpp"
#include "model/specialist/judge/classes.hpp"
#include "model/specialist/fit/loop_window.hpp"

namespace loopwarden::specialist {

// own: repeats the moves of the model's scenario, with one of them in the first half of the window.
enum class SetPointMoves : std::uint8_t { any, steps, own };

struct WindowRequest {
  Condition condition = Condition::no_fault;
  // For `other`: one of other_names(); empty for any of them.
  std::string_view other{};
  SetPointMoves moves = SetPointMoves::any;
  // Severity in % of the CO span; for low air supply the fill rate in %/s; 0: drawn.
  double severity_percent = 0.0;
  // Lower end of the drawn range. The upper end is 20 (12 for hysteresis in the thesis's form).
  double least_percent = 1.5;
  // PV noise, % of PV span; negative: drawn.
  double noise_percent = -1.0;
};

struct SimulatedWindow {
  std::vector<double> pv;  // PV units
  std::vector<double> co;  // CO units
  std::vector<double> sp;  // PV units
  Condition condition = Condition::no_fault;
  // % of CO span: s, dead band, width, offset; for low air supply the largest deviation of the
  // stem.
  double severity_percent = 0.0;

  numeric::LoopView view() const noexcept { return {.pv = pv, .co = co}; }
};

// Returns the names from which `other` is drawn.
std::span<const std::string_view> other_names() noexcept;

// Simulates a run of any length. Throws std::invalid_argument for an unknown name of `other`,
// effects::EffectError for a model that can't be simulated.
SimulatedWindow simulate_run(const plant::LoopModel& model, const WindowRequest& request,
                             std::uint64_t seed, std::size_t samples);
// Simulates a run and returns kWindowSamples of it.
SimulatedWindow simulate_window(const plant::LoopModel& model, const WindowRequest& request,
                                std::uint64_t seed);

}  // namespace loopwarden::specialist
