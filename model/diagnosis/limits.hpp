// SPDX-License-Identifier: Apache-2.0
// Constants that decide the diagnosis of routine records.
// Source: chosen by hand on simulated loops and on the records of examples/, unless a line or a
// section names another. `loopwarden-study diagnose` measures their effect, and
// `loopwarden-study plant --score` that of groups and neighbours. The search grids are in the
// estimator. The trees (classifier.table) are trained.
#pragma once

#include <cstddef>

namespace loopwarden::diagnosis {

struct DiagnosisLimits {
  // Preparation and its gates.
  static constexpr std::size_t kLeastSamples = 100;
  static constexpr double kSamplesPerPeriod = 40.0;   // at most, also of phase and play
  static constexpr double kWindowPeriods = 3.0;       // of the moving mean
  static constexpr double kUpset = 2.5;               // times the range from 5 to 95 %: cut back
  static constexpr std::size_t kLongestGap = 10;      // samples that are filled
  static constexpr double kManualShare = 0.2;         // of the record with CO at rest
  static constexpr double kFrozenShare = 0.3;         // of the record: PV at rest while CO moves
  static constexpr double kNoFlowShare = 0.9;         // of the samples with PV at zero
  static constexpr double kZero = 0.02;               // of the largest PV or SP
  static constexpr double kTravel = 0.01;             // of the CO span: CO travels
  static constexpr double kLeastMovement = 1e-4;      // of the CO span
  static constexpr double kClampedShare = 1.0 / 3.0;  // of the samples with CO at its limits
  static constexpr double kFreeShare = 0.25;          // of the samples, in a row off the limits
  static constexpr double kCutFrom = 0.03;          // of the samples at the limits: leave them out
  static constexpr double kSameValue = 1e-6;        // of the range of CO
  static constexpr double kNearEnd = 1e-3;          // of the CO span: CO is at an end of it
  static constexpr double kLeastRest = 4.0;         // samples at the highest or lowest CO
  static constexpr double kLongRest = 4.0;          // times as long as CO rests elsewhere
  static constexpr double kAtSetPoint = 0.005;      // of the largest PV or SP: PV is at SP
  static constexpr double kFarFromSetPoint = 0.05;  // of the largest PV or SP
  static constexpr double kNoiseOff = 6.0;          // times the noise of PV: far from SP
  static constexpr double kOneSide = 0.9;           // of the samples with PV on one side of SP
  static constexpr std::size_t kMostDeadTime = 60;  // samples, of a survey's window
  static constexpr std::size_t kVariabilityOrder = 20;  // m (Desborough and Harris 1992)

  // Oscillation and time scale.
  static constexpr double kCrossingDepth = 0.03;     // of the autocorrelation; less is chance
  static constexpr std::size_t kMostIntervals = 10;  // between zero crossings (Thornhill 2003)
  static constexpr double kRegular = 1.0;            // r of an oscillation (Thornhill 2003)
  static constexpr double kHighestRegularity = 20.0;
  static constexpr double kRegularityThatCounts = 3.0;  // r, for the choice of a scale
  static constexpr double kPeakThatRepeats = 0.15;      // of the autocorrelation
  static constexpr double kLeastPeak = 0.3;             // of the autocorrelation one period on
  static constexpr double kLeastCycles = 3.0;           // of a record that cycles
  static constexpr double kShorter = 0.5;      // period of a cycle over that of all movement
  static constexpr double kSamePeriod = 0.15;  // relative difference of SP's and PV's period

  // Shapes and holds.
  static constexpr double kShapeCrossingDepth = 0.3;   // of the RMS
  static constexpr std::size_t kLeastInHalfCycle = 4;  // samples
  static constexpr double kPartOfPeriod = 1.0 / 14.0;  // over which holds count changes
  static constexpr double kSteadyWord = 0.5;           // of the changes' deviation (Yamashita 2006)
  static constexpr std::size_t kLeastOfBlocks = 120;   // blocks of a record

  // Reversals of CO.
  static constexpr double kReversalDepth = 0.25;  // of the range of CO
  static constexpr std::size_t kLeastReversals = 6;
  static constexpr std::size_t kLeastForTime = 8;        // reversals
  static constexpr std::size_t kLeastForClockwork = 16;  // reversals
  static constexpr std::size_t kLeastFours = 4;          // times over four cycles
  static constexpr double kLeastScatter = 1e-6;          // used instead of 0
  static constexpr double kSteadyTravel = 0.3;           // scatter
  static constexpr double kSteadyCycle = 0.4;            // scatter
  static constexpr double kClockwork = 0.06;             // scatter of the cycle
  static constexpr double kForgetsPhase = 1.5;           // scatter of four cycles over that of one
  static constexpr double kLeastForgotten = 0.04;        // scatter of four cycles, not rounding
  static constexpr double kByTravelFrom = 1.5;           // scatter of cycle over that of travel
  static constexpr double kByTimeBelow = 1.1;            // the same
  static constexpr double kByTimeForgetting = 0.8;       // the same, if the cycle forgets its phase

  // Decision. The weights have the greatest likelihood on simulated loops, half of them sticking.
  // At kNamedFrom, 2 % of simulated loops without a valve fault are called a valve effect, at
  // kSeenFrom 0.2 % (`loopwarden-study diagnose --cases 2000 --seed 44`).
  static constexpr double kPrior = -0.9;
  static constexpr double kPerNat = 0.15;
  static constexpr double kLeastNats = -10.0;
  static constexpr double kMostNats = 15.0;
  static constexpr double kPerStanding = 2.9;
  static constexpr double kMostStanding = 0.8;
  static constexpr double kForTravel = 1.0;      // CO turns by travel
  static constexpr double kAgainstTime = 0.4;    // CO turns by time or with an external oscillation
  static constexpr double kNamedFrom = 4.0;      // nats
  static constexpr double kSeenFrom = 15.0;      // nats
  static constexpr double kExplainedFrom = 0.5;  // of PV's variance, by the band in free run
  static constexpr double kStandsFrom = 0.4;     // standing, for the grade seen
  static constexpr double kNeverStands = 0.1;    // standing
  static constexpr double kDecidedFrom = 0.65;   // p
  static constexpr double kDecidedBelow = 0.45;  // p
  static constexpr double kLeastProbability = 0.1;
  static constexpr double kMostProbability = 0.95;

  // Effect and size. The size is right in the median of simulated loops, and in nine of ten
  // within the factor (`loopwarden-study diagnose --cases 1500 --seed 3`).
  static constexpr double kBacklashOdds = 5.0;  // sticking valves over backlash in the training
  static constexpr double kAlternative = 0.1;   // share of the other effect that is named too
  static constexpr double kSizeScale = 1.15;
  static constexpr double kSizeFactor = 1.6;

  // Bands that CO travels so that a reversal shows (docs/math/valve-evidence.md).
  static constexpr double kCrossedBands = 1.6;

  // Archives.
  static constexpr double kHideAllPercent = 3.0;    // of the CO span
  static constexpr double kHideShareOfMoves = 0.3;  // of the range of CO

  // Groups and nonlinearity (Thornhill 2005).
  static constexpr double kSameGroupPeriod = 1.04;  // ratio
  static constexpr std::size_t kSamplesPerCycle = 12;
  static constexpr std::size_t kEmbedding = 10;  // samples
  static constexpr std::size_t kHorizon = 3;     // samples
  static constexpr std::size_t kNeighbours = 8;  // nearest rows
  static constexpr std::size_t kSurrogates = 20;
  static constexpr double kLeastPeriods = 4.0;

  // Neighbours.
  static constexpr std::size_t kHistoryLags = 6;    // samples
  static constexpr std::size_t kFirstLag = 2;       // samples, of the source
  static constexpr std::size_t kOtherLags = 4;      // of the source
  static constexpr std::size_t kSuddenSamples = 3;  // of a sudden move
  static constexpr std::size_t kJumpsApart = 3;     // samples
  static constexpr double kJumpFrom = 5.0;          // robust standard deviations
  static constexpr double kFullMove = 3.0;          // the same
  static constexpr std::size_t kLeastJumps = 8;
  static constexpr double kLeastAgreement = 1.5;   // S
  static constexpr double kLeastVictimMove = 0.1;  // of the deviation of its PV
  static constexpr std::size_t kLeastRows = 400;   // samples
  static constexpr std::size_t kShifts = 20;
  static constexpr double kLeastPredicted = 0.1;       // gain of the whole record
  static constexpr double kLeastPredictedPart = 0.05;  // gain of each part
  static constexpr double kOtherWay = 4.0;             // times the gain in the other direction
  static constexpr std::size_t kSummedMoves = 4;       // samples, for the choice of pairs
  static constexpr double kFirstCorrelation = 4.0;     // standard deviations by chance, the same
};
using Limits = DiagnosisLimits;  // in this folder

}  // namespace loopwarden::diagnosis
