// SPDX-License-Identifier: Apache-2.0
// Constants that decide when and how planned moves act.
// Source: tuned on simulated loops of seeds below 100. `loopwarden-study calm --only planned_moves`
// measures their effect. The symbols are those of docs/math/planned-moves.md.
#pragma once

#include <cstdint>
#include <limits>

namespace loopwarden::control {

struct PlannedMovesLimits {
  // Estimates.
  static constexpr double kModelError = 0.15;    // of the part of a move that PV has still to go
  static constexpr double kGainError = 0.1;      // of a completed move
  static constexpr double kConfidence = 4.0;     // squared standard deviations of d
  static constexpr double kActuatorLag_s = 1.0;  // first estimate if no lag is given
  static constexpr double kReadBack_s = 1.0;     // renewal interval until two values are seen
  static constexpr double kSlipVisible = 2.5;    // of the read-back's zone: j that shows slips

  // The loop without planned moves.
  static constexpr double kBaselineError = 0.15;  // standard error of v0, relative
  static constexpr double kVisibleTravel = 0.3;   // of j per cycle: the read-back shows slips
  static constexpr int kLeastCyclesWatched = 3;   // before planned moves engage
  static constexpr int kMostCyclesWatched = 10;   // the same

  // Probe.
  static constexpr double kProbe = 0.35;             // of s
  static constexpr double kProbeFollows = 0.4;       // of the probe
  static constexpr double kProbeWait_s = 4.0;        // plus the settling time of the read-back
  static constexpr std::uint32_t kProbeSamples = 3;  // in a row
  static constexpr double kProbeCycles = 10.0;       // between two probes
  static constexpr std::uint32_t kProbeMoves = 25;   // between two probes
  static constexpr std::uint32_t kFreeLandings = 2;  // as without friction, before a probe
  static constexpr double kProbeCost = 0.5;          // of kExcess

  // Strokes.
  static constexpr double kDirect = 1.08;             // of j: shortest move in one stroke
  static constexpr double kDetour = 1.15;             // of j: first stroke of a shorter move
  static constexpr double kMoved = 0.3;               // of the expected move: the stem has moved
  static constexpr std::uint32_t kFailedStrokes = 2;  // in a row
  static constexpr double kLate_s = 10.0;             // after a stroke that did not move the stem
  static constexpr double kShown = 0.4;               // of L + T: rest between two moves

  // Threshold.
  static constexpr std::uint32_t kThresholds = 60;
  static constexpr double kLargestThreshold = 3.0;  // of sqrt(v0)
  static constexpr double kTravel = 0.95;           // of the travel without planned moves

  // Benefit.
  static constexpr double kWindowCycles = 4.0;    // length of a window
  static constexpr std::uint32_t kWindows = 4;    // before the gain is judged
  static constexpr double kWindowWeight = 0.4;    // of the newest window in the gain
  static constexpr double kLargestGain = 1.1;     // RMS over that without
  static constexpr double kExcess = 2.0;          // cycles of v0, most excess of squared error
  static constexpr double kSaved = 1.0;           // cycles of v0, most that is saved against it
  static constexpr double kLargestSquare = 16.0;  // of v0: most that one sample counts

  // Band of PV in which the controller holds CO: below and above PV and SP of the newest sample.
  static constexpr double kBandErrors = 4.0;  // sqrt(v0)
  static constexpr double kBandNoise = 8.0;   // standard deviations of PV's noise

  // Disengagement.
  static constexpr double kRestCycles = 10.0;          // until the loop is watched again
  static constexpr std::uint32_t kDisengagements = 3;  // the last of them latches
  static constexpr std::uint32_t kContradictions = 2;  // with a read-back
  static constexpr std::uint32_t kUnanswered = 6;      // without a read-back

  // Stem estimator.
  static constexpr double kReadBackNoise = 0.05;        // of j, standard deviation of the read-back
  static constexpr double kReadBackNoiseWeight = 0.02;  // of the newest value
  static constexpr double kNoiseZone = 4.5;             // standard deviations
  static constexpr double kStepZone = 1.5;              // steps of the converter
  static constexpr double kLargestStep = 0.2;           // of j: a longer change is a slip
  static constexpr double kLeastZone = 1e-3;            // of s
  static constexpr double kNoChange = 1e-6;             // of s
  static constexpr double kStoodSamples = 8.0;          // before a slip that is learnt from
  static constexpr double kMostAveraged = 200.0;        // samples

  // Friction.
  static constexpr double kLowestFriction = 0.6;    // of the given interval's low end
  static constexpr double kHighestFriction = 1.6;   // of the given interval's high end
  static constexpr double kLeastSlipWeight = 0.25;  // of a slip
  static constexpr double kKineticWeight = 0.5;     // of the newest landing in the kinetic offset
  static constexpr double kForceStep = 1.15;        // factor per move that PV did not answer
  static constexpr double kMostForce = 2.0;         // factor on the breakaway

  // Disturbance estimator.
  static constexpr double kPvNoiseWeight = 0.01;      // of the newest change of PV
  static constexpr double kLeastIntensity = 0.002;    // of gain j / sqrt(L + T)
  static constexpr double kOneSided = 9.0;            // variances of the mean of the innovation
  static constexpr double kLeastDisturbance = 1e-12;  // of (gain s)^2

  // Planner.
  static constexpr double kLandingError = 0.03;    // of j
  static constexpr double kLandingInterval = 0.1;  // of the width of j's interval
  static constexpr double kLandingWeight = 0.2;    // of the newest landing
  static constexpr double kLeastLanding = 1e-3;    // of gain j
  static constexpr double kLeastThreshold = 1.5;   // of the landing's error
  static constexpr double kFirstThreshold = 0.5;   // of gain j
  static constexpr double kLeastWalk = 1e-12;      // of (gain j)^2
  static constexpr double kWalkThresholds = 3.0;   // h^2 that the given intensity counts
  static constexpr double kForget = 0.9;           // of the moves so far
  static constexpr double kTravelCost = 0.05;      // of v0 for the travel without planned moves
  static constexpr double kBudgetCost = 10.0;      // of v0 for a budget exceeded by itself
  static constexpr double kDetourForce = 1.05;     // of the sure breakaway
  static constexpr double kMargins[] = {0.0, -0.3, -0.6, -0.85};  // m / h

  // Budget.
  static constexpr double kTokens = 2.0;         // moves, at the start
  static constexpr double kTokenHours = 6.0;     // the bucket holds 1/6 of an hour's moves
  static constexpr double kFirstTravel = 8.0;    // j
  static constexpr double kMostTravel = 15.0;    // j
  static constexpr double kMostOverdraft = 8.0;  // j

  // Times of a stroke.
  static constexpr double kSettleSamples = 3.0;  // values of the read-back
  static constexpr double kSettleLags = 5.0;     // of the actuator
  static constexpr double kPush_s = 3.0;         // least time of a push by the stick band
  static constexpr double kPushSamples = 10.0;   // the same, values of the read-back
  static constexpr double kPushRate = 0.5;       // of the output's rate limit
  static constexpr double kStandsFirst = 2.0;    // values of the read-back
  static constexpr double kStandsLast = 4.0;     // values of the read-back
  static constexpr double kStandsTook = 0.7;     // of the time that the stem took
  static constexpr double kLagWeight = 0.5;      // of the newest stroke

  static constexpr double kQuietSamples = 5.0;  // values of the read-back before the push

  // Response check.
  static constexpr double kClearResponse = 25.0;   // squared move over the variance of d
  static constexpr double kMissingResponse = 0.4;  // of the move: the answer is missing below it

  // Planned moves.
  static constexpr double kLostResponses = 0.25;  // of L + T: longest loss of the read-back
  static constexpr double kLostSamples = 3.0;     // the same, in periods
  static constexpr double kStrainTravel = 4.0;    // j: overdrawn travel that doubles the threshold
  static constexpr double kFreeLanding = 0.3;     // of the kinetic offset: as without friction
  static constexpr double kFreeZones = 2.0;       // zones: smaller kinetic offsets are not visible
  static constexpr double kLeastBaseline = 0.1;   // of gain j, standard deviation of SP - PV

  static constexpr double kNever = std::numeric_limits<double>::infinity();
};

}  // namespace loopwarden::control
