// SPDX-License-Identifier: Apache-2.0
// Valve effect or not, from three numbers: phase, play and Hammerstein evidence.
//
//   logit p = w0 + w1 ph + w2 pl + w3 sqrt(max(A, 0))
//
// The weights (decision_weights.hpp) are written by `loopwarden-study diagnose --weights`: greatest likelihood on simulated loops
// and on the open records, half of the weight each, sticky and other loops alike, and every loop alike; none below 0, so that
// more evidence never makes a valve effect less probable. The prior is one half; another prior moves logit p by
// log(prior / (1 - prior)). One set where PV must follow CO at once, and where nothing is known of the loop; another for levels,
// temperatures, and any loop whose PV moved to a new set point while CO came back to where it was (it integrates). p is kept within
// 0.1 to 0.95, as no routine record proves more: of the simulated loops below 0.1 more than a tenth stick.
//
//   seen        p >= 0.65, A > 0.1 and a gain in six of the record's eight parts (levels and temperatures: 0.15, seven): CO travels, PV
//               stays, and moves only when the band is crossed
//   likely      p >= 0.65 and A > 0.05: test the valve
//   can't tell  p from 0.35 to 0.65; p >= 0.65 without A: integral control against a slow load looks the same; phase and play
//               for a valve where they mean nothing
//
// What it can't do: tell the valve from anything else behind the controller that sticks.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "model/diagnosis/kind.hpp"

namespace loopwarden::diagnosis {

inline constexpr double kSeenFrom = 0.1;         // A, where PV follows CO at once
inline constexpr double kSeenLaterFrom = 0.15;   // A, where it need not
inline constexpr double kLikelyFrom = 0.05;      // A
inline constexpr double kPartsFor = 0.75;        // of the record, for what is seen
inline constexpr double kPartsForLater = 0.875;  // the same, where PV need not follow at once
inline constexpr double kDecidedFrom = 0.65;
inline constexpr double kDecidedBelow = 0.35;
inline constexpr double kLeastProbability = 0.1;
inline constexpr double kMostProbability = 0.95;

// The three numbers of a record; each votes for a valve effect above its threshold.
struct ValveEvidence {
  double phase = 0.0;        // ph, votes above 0
  double play = 0.0;         // pl, votes above 0
  double hammerstein = 0.0;  // A, votes above 0.1
  double parts_for = 1.0;    // share of the record's parts that A comes from
  int votes() const noexcept {
    return (phase > 0.0 ? 1 : 0) + (play > 0.0 ? 1 : 0) + (hammerstein > kSeenFrom ? 1 : 0);
  }
};

// Does PV follow CO at once? What the phase and the play mean depends on it.
enum class Follows : std::uint8_t { at_once, by_integration, slowly };

enum class Grade : std::uint8_t { none, likely, seen };
const char* to_text(Grade grade) noexcept;

struct ValveDecision {
  double probability = 0.5;  // of a valve effect
  Grade grade = Grade::none;
  bool undecided = false;
  std::string reason;  // where undecided: why
  std::string settle;  // and what would settle it
};

// The numbers as they are weighed: ph, pl, sqrt(max(A, 0)).
using ValveTerms = std::array<double, 3>;
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
