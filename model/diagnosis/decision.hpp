// SPDX-License-Identifier: Apache-2.0
// Decides whether a valve effect exists, from five indicators: phase, play, standing, Hammerstein
// evidence, and the turns of CO. Rules: docs/math/valve-evidence.md.
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
