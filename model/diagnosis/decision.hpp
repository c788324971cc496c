// SPDX-License-Identifier: Apache-2.0
// Decides whether a valve effect exists, from the likelihoods of a band (estimator/band.hpp) and of
// a slip jump (estimator/slip_jump.hpp), the share of CO's moves at which PV rests, and the turns
// of CO. Rules: docs/math/valve-evidence.md.
//
// Limits: it can't distinguish the valve from other sticking parts after the controller.
#pragma once

#include <cstdint>
#include <string>

#include "model/diagnosis/reversals.hpp"

namespace loopwarden::diagnosis {

struct ValveEvidence {
  double log_odds = 0.0;   // nats, for a band of at least 0.3 of CO's movement
  double share = 0.0;      // the band over CO's movement
  double explained = 0.0;  // of PV's variance, by the band in free run; may be negative
  double standing = 0.0;   // share of CO's moves during which PV rests, 0 to 1
  double jump = 0.0;       // nats, for a slip jump of the stem against none; 0 without a band
  Reversals reversals{};
};

enum class Grade : std::uint8_t { none, likely, seen };
const char* to_text(Grade grade) noexcept;

struct ValveDecision {
  double probability = 0.5;  // of a valve effect
  Grade grade = Grade::none;
  bool undecided = false;
  bool by_cycle = false;  // if undecided: only the end of the cycle in manual decides
  std::string reason;     // if undecided: the reason
};

ValveDecision decide(const ValveEvidence& evidence);

double logit(double p);
double from_logit(double z);

}  // namespace loopwarden::diagnosis
