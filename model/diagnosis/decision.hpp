// SPDX-License-Identifier: Apache-2.0
// Decides whether a valve effect exists, from five indicators: phase, play, standing, Hammerstein
// evidence, and the turns of CO.
//
//   logit p = w0 + w1 ph + w2 pl + w3 standing + w4 sqrt(A)
//             pl within -0.5 to 0.8; A from 0 to 0.5
//
// `loopwarden-study diagnose --weights` writes the weights (decision_weights.hpp). They have the
// greatest likelihood on the open measured records and on simulated loops. Sticky and other loops
// have the same weight, and so has every loop. Weights are at least 0, so more evidence never
// makes a valve effect less probable. w4 is at most 2, because A ranked held-out measured loops no
// better than chance. The prior is one half; another prior moves logit p by
// log(prior / (1 - prior)). One set of weights is for loops whose PV must follow CO at once, and
// for unknown loops.
// Another set is for levels, temperatures, and integrating loops: those whose PV moved to a new set
// point while CO returned to its former value. p is limited to 0.1 to 0.95.
//
// The turns of CO (reversals.hpp) have their own rules, since a smooth external oscillation
// deceives the other four:
//
//   by time      A counts 0, because with an oscillating load any band predicts PV better; no valve
//                effect is named
//   clockwork    an external oscillation; no valve effect is named
//
// Further rules:
//
//   no relation  a play explains less than 0.2 of PV, so PV does not depend on CO: p at most 0.3
//   no band      pl at most 0 and A at most 0.05: p at most 0.35
//   in step      ph below -2 and A at most 0.1: p at most 0.35
//   a band       pl > 0.2 and A > 0.3: p at least 0.7, whatever the phase is, because set points
//                that move carry PV and CO along together
//   slow loops   levels and temperatures get no verdict if the loop does not cycle, or if PV never
//                rests while CO moves. With a banded valve, an integrating loop under PI cycles
//                (T. Haegglund, Journal of Process Control 17, 2007), and a load moves any slow
//                loop in a way that A takes for a band. A slow loop that does not integrate need
//                not cycle with backlash, and its backlash is missed
//
// Grades:
//
//   seen        p >= 0.7, CO turns by travel, PV rests during more than 0.4 of CO's moves; levels
//               and temperatures also need A > 0.15
//   likely      p >= 0.65 (levels and temperatures: and A > 0.05): test the valve
//   can't tell  p from 0.35 to 0.65; p >= 0.65 and CO turns by time or with an external
//               oscillation; phase and play for a valve on a loop for which they have no meaning
//
// Limits: it can't distinguish the valve from other sticking parts after the controller.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/loop_type.hpp"
#include "model/diagnosis/reversals.hpp"

namespace loopwarden::diagnosis {

// The indicators of a record. Phase, play and A vote for a valve effect above their thresholds.
struct ValveEvidence {
  double phase = 0.0;        // ph, votes above 0
  double play = 0.0;         // pl, votes above 0
  double hammerstein = 0.0;  // A, votes above 0.1
  double parts_for = 1.0;    // share of the record's parts with g above 0
  double standing = 0.0;     // share of CO's moves during which PV rests, 0 to 1
  double relation = 1.0;     // share of PV's variance that a play explains, 0 to 1
  Reversals reversals{};
  int votes() const noexcept {
    return (phase > 0.0 ? 1 : 0) + (play > 0.0 ? 1 : 0) +
           (hammerstein > Limits::kHammersteinVotes ? 1 : 0);
  }
};

// How PV follows CO. The meaning of phase and play depends on it.
enum class Follows : std::uint8_t { at_once, by_integration, slowly };

// The test that settles most undecided cases.
inline constexpr const char* kManualSteps =
    "in manual, step CO by 2 % up, then by 2 % up and down again, and look when PV answers";

enum class Grade : std::uint8_t { none, likely, seen };
const char* to_text(Grade grade) noexcept;

struct ValveDecision {
  double probability = 0.5;  // of a valve effect
  Grade grade = Grade::none;
  bool undecided = false;
  std::string reason;  // if undecided: the reason
  std::string settle;  // if undecided: the remedy
};

// The indicators as inputs of the weights: ph, pl, standing, sqrt(A).
using ValveTerms = std::array<double, 4>;
ValveTerms terms_of(const ValveEvidence& evidence);

struct ValveWeights {
  double base = 0.0;
  ValveTerms per{};  // all >= 0
  double logit_of(const ValveTerms& x) const;
};
const ValveWeights& weights_for(Follows follows);

ValveDecision decide(const ValveEvidence& evidence, Follows follows);
ValveDecision decide(const ValveEvidence& evidence, Follows follows, const ValveWeights& weights);

double logit(double p);
double from_logit(double z);

}  // namespace loopwarden::diagnosis
