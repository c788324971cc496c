// SPDX-License-Identifier: Apache-2.0
// Valve effect or not, from three numbers: phase, play and Hammerstein evidence.
//
//   logit p = w0 + w1 ph + w2 pl + w3 A      where PV must follow CO at once
//   logit p = v0 + v3 A                      where it need not: levels, temperatures, and any loop whose PV moved to a new set
//                                            point while CO came back to where it was (the process integrates)
//
// All weights are positive: more evidence never makes a valve effect less probable. p is kept within 0.05 to 0.9, as no routine
// record proves more. Set by hand near fits to the open records with loops and classes
// weighted equally: the prior is one half; another prior moves
// logit p by log(prior / (1 - prior)).
//
//   seen        p >= 0.65 and A > 0.1: CO travels, PV stays, and moves only when the band is crossed
//   likely      p >= 0.65 by phase and play, A above 0 at least: test the valve
//   can't tell  p from 0.35 to 0.65; phase and play speak for a valve but A does not: integral control against a slow load
//               looks the same
//
// What it can't do: tell the valve from anything else behind the controller that sticks.
#pragma once

#include <cstdint>
#include <string>

#include "model/diagnosis/kind.hpp"

namespace loopwarden::diagnosis {

inline constexpr double kSeenFrom = 0.1;  // A
inline constexpr double kDecidedFrom = 0.65;
inline constexpr double kDecidedBelow = 0.35;
inline constexpr double kLeastProbability = 0.05;
inline constexpr double kMostProbability = 0.9;

// The three numbers of a record; each votes for a valve effect above its threshold.
struct ValveEvidence {
  double phase = 0.0;        // ph, votes above 0
  double play = 0.0;         // pl, votes above 0
  double hammerstein = 0.0;  // A, votes above 0.1
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

ValveDecision decide(const ValveEvidence& evidence, Follows follows);

double logit(double p);
double from_logit(double z);

}  // namespace loopwarden::diagnosis
