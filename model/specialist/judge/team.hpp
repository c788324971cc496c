// SPDX-License-Identifier: Apache-2.0
// The team of specialists. They fit a window instead of redrawing it, and can return "unknown".
//
// Each specialist knows one condition. It fits the window from CO to PV by its own fault
// (window_fitter.hpp), and its network weighs the evidence of all fits into one score:
//
//   p_c = exp(score_c / temperature) / sum over the specialists of exp(score / temperature)
//
// `other` is the specialist for faults outside the valve. The verdict is the first that applies:
//   1. a fault, if the p of all faults together reach kFault, that of the best one reaches kNamed,
//      and its error is at most the kMisfitQuantile of its training windows
//   2. no_fault, with the same conditions and kNoFault
//   3. unknown, if `other` reaches kUnknown or no known condition fits
//   4. not_enough_movement: several fault models fit equally well, or CO hardly moved, or CO was
//      at an end of its range for long
// The start of the window, set points, step sizes and units have no effect. Another process needs
// other LoopFacts but no other networks (accuracy: docs/explanation/accuracy.md).
//
// Limits: two faults at once get one name. A fault that the window's movement does not reach leaves
// no trace, and a healthy verdict on such a window doesn't exclude it.
//
// Sources: the set of specialists and the lowest error: Sewdass, thesis (Durban University of
// Technology), ch. 8; temperature: C. Guo, G. Pleiss, Y. Sun and K. Weinberger, Proc. ICML (2017).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/numeric/loop_record.hpp"
#include "model/specialist/judge/classes.hpp"
#include "model/specialist/fit/network_inputs.hpp"
#include "model/specialist/judge/network.hpp"

namespace loopwarden::specialist {

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
  double probability =
      0.0;  // of the verdict's condition; for `unknown`, that of no known condition
  double severity_percent = 0.0;  // of CO span; 0 without a fault
  std::array<double, kConditions> probabilities{};
  std::array<double, kConditions> mse{};  // of each fault model, (% of CO span)^2
};

// Judges windows with a team. No allocation after construction.
class TeamJudge {
 public:
  explicit TeamJudge(const Team& team);

  WindowVerdict judge(const numeric::LoopView& window) noexcept;
  // Returns the verdict for existing fits.
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

// Returns the mean square error of this condition's model, (% of CO span)^2. For hysteresis, of the
// better form.
double misfit_of(const WindowFits& found, Condition condition) noexcept;
// Returns the size of the fault, % of CO span, from its model. It is limited to the size that the
// window can show: the range of CO or, for an offset or low air, the range of PV over the gain if
// that is larger. 0 without a valve fault.
double severity_of(const WindowFits& found, Condition condition) noexcept;

}  // namespace loopwarden::specialist
