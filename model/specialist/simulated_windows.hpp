// SPDX-License-Identifier: Apache-2.0
// Windows of the simulated loop with a condition of random severity: what specialists learn from.
//
// Drawn for each window from its own seed: gain, time constant and dead time within twice the model's
// uncertainty, a second lag and the actuator's of its own, tuning, healthy friction, noise, a wandering load now
// and then, and what the set point does. The condition has been there for long, and the window
// starts at a random moment. Faults by every law that model/plant has for them.
#pragma once

#include <cstdint>
#include <vector>

#include "model/plant/loop_model.hpp"
#include "model/specialist/classes.hpp"
#include "model/specialist/loop_window.hpp"

namespace loopwarden::specialist {

enum class SetPointMoves : std::uint8_t { any, steps };

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
