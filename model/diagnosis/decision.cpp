// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/decision.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {

const char* to_text(Grade grade) noexcept {
  return numeric::enum_name<Grade::seen>(grade, {"none", "likely", "seen"});
}

double logit(double p) { return std::log(p / (1.0 - p)); }
double from_logit(double z) { return 1.0 / (1.0 + std::exp(-z)); }

ValveDecision decide(const ValveEvidence& e) {
  const ReversalsBy turns = e.reversals.by();
  const bool jumps = e.jump >= Limits::kNamedFrom;
  // A regular disturbance with edges looks like slip jumps, but keeps the time like a clock.
  const bool external = turns == ReversalsBy::clockwork || (turns == ReversalsBy::time && !jumps);
  const double z = Limits::kPrior +
                   Limits::kPerNat * std::clamp(e.log_odds, Limits::kLeastNats, Limits::kMostNats) +
                   Limits::kPerNat * std::clamp(e.jump, 0.0, Limits::kMostNats) +
                   Limits::kPerStanding * std::min(e.standing, Limits::kMostStanding) +
                   (turns == ReversalsBy::travel ? Limits::kForTravel : 0.0) -
                   (external ? Limits::kAgainstTime : 0.0);
  ValveDecision d;
  d.probability = std::clamp(from_logit(z), Limits::kLeastProbability, Limits::kMostProbability);
  const bool band = e.log_odds >= Limits::kNamedFrom && d.probability >= Limits::kDecidedFrom;
  if (band && !external && !jumps && e.explained < Limits::kExplainedFrom) {
    d.undecided = true;
    d.reason = "a band predicts PV from sample to sample, but not its movement";
    return d;
  }
  if (band && !external) {
    const bool seen = e.log_odds >= Limits::kSeenFrom && e.standing > Limits::kStandsFrom;
    d.grade = seen ? Grade::seen : Grade::likely;
    return d;
  }
  if (band && e.standing > Limits::kNeverStands) {
    d.undecided = true;
    d.reason = turns == ReversalsBy::time
                   ? "the cycle has a constant period and not a constant travel of CO, like an "
                     "external oscillation; all other evidence indicates a sticking valve"
                   : "the loop cycles with a constant period: a sticking valve and a regular load "
                     "under tight control look alike";
    d.by_cycle = true;
    return d;
  }
  if (external) d.probability = std::min(d.probability, Limits::kDecidedBelow);
  if (d.probability <= Limits::kDecidedBelow) return d;
  d.undecided = true;
  d.reason = "a valve with a band explains this record about as well as one without";
  return d;
}

}  // namespace loopwarden::diagnosis
