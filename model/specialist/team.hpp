// SPDX-License-Identifier: Apache-2.0
// The trustworthy form: a team of specialists that fit a window instead of redrawing it.
//
// Each specialist knows one condition. It fits the window from CO to PV by its own fault (window_fitter.hpp),
// and its network weighs the evidence of all fits into one score:
//
//   p_c = exp(score_c / temperature) / sum over the specialists of exp(score / temperature)
//
// `other` is the specialist of what is no valve fault. The verdict:
//   1. a fault, where the faults' p together reach kFault, that of the best one kNamed, and it fits the
//      window no worse than kMisfitQuantile of its training windows did;
//   2. else no_fault, likewise with kNoFault;
//   3. else unknown, where `other` reaches kUnknown or no known condition fits;
//   4. else not_enough_movement: several fault models fit and the window can't tell which is right, or CO hardly
//      moved, or stood at an end of its range for long.
// Where the window starts, set points, step sizes and units do not matter; another process means other
// LoopFacts and no other networks (docs/specialists.md says how well that goes).
//
// Limits: it can't two faults at once have one name; a fault that the window's movement does not
// touch leaves no trace, and a healthy verdict on such a window says nothing about it.
//
// Sources: the set of specialists and the lowest error: Sewdass, thesis (Durban University of Technology), ch. 8;
// temperature: C. Guo, G. Pleiss, Y. Sun and K. Weinberger, Proc. ICML (2017).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "model/specialist/classes.hpp"
#include "model/window/network_inputs.hpp"
#include "model/specialist/network.hpp"

namespace loopwarden::specialist {

inline constexpr double kFault = 0.95;
inline constexpr double kNamed = 0.75;
inline constexpr double kNoFault = 0.8;
inline constexpr double kUnknown = 0.8;
inline constexpr double kMisfitQuantile = 0.995;
inline constexpr double kMostShut = 0.3;  // share of a window with CO at an end of its range
// CO's blocks within this many standard deviations of the noise is no movement.
inline constexpr double kLeastMovement = 6.0;

struct TeamMember {
  std::string name{};  // P1S16x
  Condition condition = Condition::no_fault;
  Network network;  // inputs -> hidden -> hidden -> score
  double most_misfit =
      0.0;  // log of mse over noise variance that this condition's windows seldom exceed
};

struct Team {
  LoopFacts facts;
  std::array<double, kNetworkInputs> centre{};
  std::array<double, kNetworkInputs> scale{};   // > 0
  double temperature = 1.0;                     // > 0
  std::array<TeamMember, kConditions> members;  // in the order of Condition
};

struct WindowVerdict {
  VerdictName verdict = VerdictName::not_enough_movement;
  double probability = 0.0;       // of the verdict's condition; of `unknown` what no known one has
  double severity_percent = 0.0;  // of CO span; 0 without a fault
  std::array<double, kConditions> probabilities{};
  std::array<double, kConditions> mse{};  // of each fault model, (% of CO span)^2
};

// No allocation after construction.
class TeamJudge {
 public:
  explicit TeamJudge(const Team& team);

  WindowVerdict judge(const LoopWindow& window) noexcept;
  // The same from fits made before.
  WindowVerdict judge(const WindowFits& found) noexcept;

  const LoopFacts& facts() const noexcept { return fitter_.facts(); }

 private:
  WindowFitter fitter_;
  std::array<double, kNetworkInputs> centre_;
  std::array<double, kNetworkInputs> scale_;
  double temperature_;
  std::array<double, kConditions> most_misfit_{};
  std::vector<Responder> responders_;
};

// Mean square that the model of this condition leaves, (% of CO span)^2. Of hysteresis the better form.
double misfit_of(const WindowFits& found, Condition condition) noexcept;
// Size of the fault, % of CO span, as its model has it but no more than the window can show: the range that
// CO moved in it; of an offset or of low air, that of PV over the gain where it is larger. 0 of what is no fault.
double severity_of(const WindowFits& found, Condition condition) noexcept;

}  // namespace loopwarden::specialist
