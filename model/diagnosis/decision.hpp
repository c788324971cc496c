// SPDX-License-Identifier: Apache-2.0
// Valve effect or not, from five witnesses: phase, play, standing, Hammerstein evidence, and how CO turns.
//
//   logit p = w0 + w1 ph + w2 pl + w3 standing + w4 sqrt(A)       pl within -0.5 to 0.8; A from 0 to 0.5
//
// The weights (decision_weights.hpp) are written by `loopwarden-study diagnose --weights`: greatest likelihood on the open measured
// records and on simulated loops, sticky and other loops alike, and every loop alike; none below 0, so that more evidence never
// makes a valve effect less probable; w4 at most 2, as A ranked measured loops kept apart no better than chance. The prior is one half; another prior moves logit p by log(prior / (1 - prior)). One set where
// PV must follow CO at once, and where nothing is known of the loop; another for levels, temperatures, and any loop whose PV moved
// to a new set point while CO came back to where it was (it integrates). p is kept within 0.1 to 0.95.
//
// How CO turns (turns.hpp) decides beside them, since a smooth swing from elsewhere deceives all four:
//
//   by time       A counts 0: behind a load that swings PV is foretold better by any band; no valve effect is named
//   clockwork     no valve effect is named
//   a play explains less than 0.2 of PV: PV does not hang on CO, p at most 0.3
//   no band: pl at most 0 and A at most 0.05, p at most 0.35
//   in step: ph below -2 and A at most 0.1, p at most 0.35
//   a band whatever the phase says (set points that move carry PV and CO along together): pl > 0.2 and A > 0.3, p at least 0.7
//   levels and temperatures: a loop that does not cycle, or whose PV never stands while CO moves, can't be told: behind a valve with
//   a band an integrating loop under PI cycles (T. Haegglund, Journal of Process Control 17, 2007), and a load moves any slow loop
//   in a way that A takes for a band. A slow loop that does not integrate need not cycle behind play: it is missed
//
//   seen        p >= 0.7, CO turns by travel, PV stands during more than 0.4 of CO's moves; levels and temperatures besides: A > 0.15
//   likely      p >= 0.65 (levels and temperatures: and A > 0.05): test the valve
//   can't tell  p from 0.35 to 0.65; p >= 0.65 and CO turns by time or like clockwork; phase and play for a valve where they mean
//               nothing
//
// Limits: it can't tell the valve from anything else behind the controller that sticks.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "model/diagnosis/kind.hpp"
#include "model/diagnosis/turns.hpp"

namespace loopwarden::diagnosis {

inline constexpr double kHammersteinVotes = 0.1;  // A
inline constexpr double kSeenLaterFrom = 0.15;    // A, where PV need not follow at once
inline constexpr double kLikelyLaterFrom = 0.05;  // A, the same
inline constexpr double kStandsFrom = 0.4;        // standing, for what is seen
inline constexpr double kRelatedFrom = 0.2;       // of PV's variance
inline constexpr double kUnrelatedMost = 0.3;     // p
inline constexpr double kBandFrom = 0.05;         // A
inline constexpr double kInStep = -2.0;           // ph
inline constexpr double kSurePlay = 0.2;          // pl
inline constexpr double kSureHammerstein = 0.3;   // A
inline constexpr double kNeverStands = 0.05;      // standing
inline constexpr double kSeenFrom = 0.7;          // p
inline constexpr double kDecidedFrom = 0.65;
inline constexpr double kDecidedBelow = 0.35;
inline constexpr double kLeastProbability = 0.1;
inline constexpr double kMostProbability = 0.95;

// The witnesses of a record; phase, play and A vote for a valve effect above their thresholds.
struct ValveEvidence {
  double phase = 0.0;        // ph, votes above 0
  double play = 0.0;         // pl, votes above 0
  double hammerstein = 0.0;  // A, votes above 0.1
  double parts_for = 1.0;    // share of the record's parts that A comes from
  double standing = 0.0;     // share of CO's moves during which PV stands, 0 to 1
  double relation = 1.0;     // of PV's variance that a play explains, 0 to 1
  Turns turns{};
  int votes() const noexcept {
    return (phase > 0.0 ? 1 : 0) + (play > 0.0 ? 1 : 0) + (hammerstein > kHammersteinVotes ? 1 : 0);
  }
};

// Does PV follow CO at once? What the phase and the play mean depends on it.
enum class Follows : std::uint8_t { at_once, by_integration, slowly };

// What settles most of what can't be told.
inline constexpr const char* kManualSteps =
    "in manual, step CO by 2 % up, then by 2 % up and down again, and look when PV answers";

enum class Grade : std::uint8_t { none, likely, seen };
const char* to_text(Grade grade) noexcept;

struct ValveDecision {
  double probability = 0.5;  // of a valve effect
  Grade grade = Grade::none;
  bool undecided = false;
  std::string reason;  // where undecided: why
  std::string settle;  // and what would settle it
};

// The witnesses as they are weighed: ph, pl, standing, sqrt(A).
using ValveTerms = std::array<double, 4>;
ValveTerms terms_of(const ValveEvidence& evidence);

struct ValveWeights {
  double base = 0.0;
  ValveTerms per{};  // none below 0
  double logit_of(const ValveTerms& x) const;
};
const ValveWeights& weights_for(Follows follows);

ValveDecision decide(const ValveEvidence& evidence, Follows follows);
ValveDecision decide(const ValveEvidence& evidence, Follows follows, const ValveWeights& weights);

double logit(double p);
double from_logit(double z);

}  // namespace loopwarden::diagnosis
