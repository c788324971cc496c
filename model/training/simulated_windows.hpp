// SPDX-License-Identifier: Apache-2.0
// Windows of the simulated loop with a condition of random severity: what specialists learn from.
//
// Drawn for each window from its own seed: gain, time constant and dead time within twice the model's
// uncertainty, a second lag and the actuator's of its own, tuning, healthy friction, noise, a wandering load now
// and then, and what the set point does. The condition has been there for long, and the window
// starts at a random moment. Faults by every law that model/plant has for them.
//
//   severity    s, deadband, width: log-uniform, least_percent to 20 % of the CO span; offset to 12 %; fill rate
//               log-uniform, 0.5 to 5 % of the CO span a second
//   tuning      gains times exp(uniform(-0.7, 0.2))     noise  log-uniform, 0.03 to 0.4 % of the PV span
//   set point   steps 60 %, square wave 15 %, ramps and waves 13 %, constant 12 % of the windows
//   other       one of other_names(), with the sizes that simulated_windows.cpp gives each
//
// Of a twin (plant::TwinFit) what was measured takes the place of these ranges: the process is drawn from its
// covariance beside its uncertainty, noise within a quarter of the twin's, its own load, tuning within a fifth, its own
// friction where it has any, and two in three windows have the set-point moves of its scenario.
//
// Errors: std::invalid_argument for a name that is none of other_names(); effects::EffectError for a model that
// can't be simulated.
// Limits: it can't two faults at once, a fault that comes or goes within the window, a valve of another make than
// the laws of model/plant.
//
// Source: none: the ranges are our choice of what plants have, and the figures of docs/specialists.md hold for them.
#pragma once

#include <cstdint>
#include <vector>

#include "model/plant/loop_model.hpp"
#include "model/specialist/classes.hpp"
#include "model/window/loop_window.hpp"

namespace loopwarden::specialist {

// own: those of the model's scenario over and over, with one of them in the first half of the window.
enum class SetPointMoves : std::uint8_t { any, steps, own };

struct WindowRequest {
  Condition condition = Condition::no_fault;
  // Of `other`: one of other_names(), empty for any.
  std::string_view other{};
  SetPointMoves moves = SetPointMoves::any;
  // Severity in % of the CO span, of low air supply its fill rate in %/s; 0: drawn.
  double severity_percent = 0.0;
  // The least that is drawn; the most is 20 (of hysteresis in the thesis's form 12).
  double least_percent = 1.5;
  // PV noise, % of PV span; negative: drawn.
  double noise_percent = -1.0;
};

struct SimulatedWindow {
  std::vector<double> pv;  // PV units
  std::vector<double> co;  // CO units
  std::vector<double> sp;  // PV units
  Condition condition = Condition::no_fault;
  // % of CO span: s, deadband, width, offset; of low air supply the most that the stem lacked.
  double severity_percent = 0.0;

  LoopWindow view() const noexcept { return {pv, co}; }
};

// What `other` is drawn from.
std::span<const std::string_view> other_names() noexcept;

// A run of any length. Throws std::invalid_argument for an unknown name of `other`, effects::EffectError for a
// model that can't be simulated.
SimulatedWindow simulate_run(const plant::LoopModel& model, const WindowRequest& request,
                             std::uint64_t seed, std::size_t samples);
// kWindowSamples of it.
SimulatedWindow simulate_window(const plant::LoopModel& model, const WindowRequest& request,
                                std::uint64_t seed);

}  // namespace loopwarden::specialist
