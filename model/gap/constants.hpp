// SPDX-License-Identifier: Apache-2.0
// Limits of the gap workflow. Those of the estimator are in estimator/constants.hpp.
//
//   by definition  the meaning of the word, or gap.json
//   by hand        chosen on development cases of lab/hidden_cases (seeds below 100000)
#pragma once

#include <cstddef>

namespace loopwarden::gap {

// check
// Shorter records are refused. By hand.
inline constexpr std::size_t kFewestSamples = 200;
// Less movement of CO, of its span, shows no effect of the valve. By hand.
inline constexpr double kLeastMovement = 0.01;
// A PV with fewer changes is frozen. By hand.
inline constexpr std::size_t kFewestMoves = 5;
// Of the transmitter's span: a PV so close to an end of it is at the end. By hand.
inline constexpr double kAtEnd = 0.001;
// Fewer measured samples in the first two thirds are not fitted. By hand.
inline constexpr std::size_t kFewestMeasured = 50;

// reading
// Renewals of PV that show an interval. By hand.
inline constexpr std::size_t kFewestRenewals = 20;
// Share of the changes that may be more than a sample off the interval: clocks slip. By hand.
inline constexpr double kOffBeat = 0.02;
// If more of the changes are by the least one, they are rounding or a coarse valve. By hand.
inline constexpr double kEqualSteps = 0.5;
// Neighbours at the end of the range, and the share of them that stay there; of that, the share
// that may stay elsewhere. By hand: noise of one rounding step leaves 0.28 of the neighbours equal.
inline constexpr std::size_t kFewestAtEnd = 8;
inline constexpr double kStaysAtEnd = 0.5;
inline constexpr double kStaysElsewhere = 0.1;
// An end of the reading this close to that of the transmitter, of its span, is the same. By hand.
inline constexpr double kSameEnd = 0.005;
// A spike's jump, in noises of the record and of the transmitter's span (an archive hides the
// noise); distance from its start and its top, of the jump; the longest, samples. By hand.
inline constexpr double kSpikeNoise = 8.0;
inline constexpr double kSpikeSpan = 0.01;
inline constexpr double kSpikeNear = 0.3;
inline constexpr std::size_t kLongestSpike = 10;
// Fewer spikes are skipped and reported, and are no effect. By hand.
inline constexpr std::size_t kFewestSpikes = 3;
// A process that forgets faster, in samples, can make a spike. By hand.
inline constexpr double kSpikeLag = 3.0;
// Confidence of a name from flat readings. By hand: a logger can fill or limit a record, too.
inline constexpr double kReadingConfidence = 0.95;

// next test
// At most so many explanations compete. By hand.
inline constexpr std::size_t kMostCompeting = 3;

// controller
// A smaller RMS error of CO, of its span, does not matter. By hand: a 12-bit step is 0.00024.
inline constexpr double kLeastControllerRms = 0.002;
// Settings closer to those of the model, relative, are the same. By hand.
inline constexpr double kSameSettings = 0.03;
// Other settings leave less than this share of the difference. By hand.
inline constexpr double kSettingsLeave = 0.3;
// A filter on PV or a dead band leaves at most this many times the error that does not matter, and
// less than this share of the error that other gains leave. By hand: a controller's law is exact.
inline constexpr double kInletMatters = 2.0;
inline constexpr double kInletLeaves = 0.5;
// Confidence of other settings: (r + 1)/(n + 2) with 10 of 11 right on development cases.
inline constexpr double kControllerConfidence = 0.85;

// decide
// Nats behind the choice: closer, and the record can't distinguish the names; more, and the other
// explanation is far less likely. By hand; Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773-795.
inline constexpr double kTooClose = 6.0;
inline constexpr double kFurtherGain = 12.0;
// Noise and a small disturbance account for an error up to this many floors, as in the estimator.
inline constexpr double kFewFloors = 2.5;
// PV that moves by less than so many noise floors has no fit percent. By definition.
inline constexpr double kFewestFloors = 3.0;
// Gap closed on the last third. By definition: below kGapFloors floors there is no such figure;
// from kClosed on a name is given as it is, from kPartlyClosed on with at most kPartlyConfidence.
inline constexpr double kGapFloors = 2.0;
inline constexpr double kClosed = 0.8;
inline constexpr double kPartlyClosed = 0.5;
inline constexpr double kPartlyConfidence = 0.89;

// Confidence if what is left of PV follows SP or CO: something else is missing, too; and the share
// of it that must follow. By definition; by hand.
inline constexpr double kMostFollowing = 0.7;
inline constexpr double kFollows = 0.5;
// Most confidence of a name. By hand:
inline constexpr double kMostUntested = 0.8;      // CO was not measured
inline constexpr double kMostResampled = 0.85;    // CO between the samples is unknown
inline constexpr double kMostLikeSimpler = 0.7;   // its interval contains a simpler effect
inline constexpr double kLargeValveEffect = 0.3;  // of the output's span: an effect of a valve
inline constexpr double kMostLarge = 0.5;         //   that exceeds this
inline constexpr double kRepeats = 0.1;           // relative: its delay repeats with SP
inline constexpr double kMostRepeating = 0.5;     //   to within this

// locate
// A pattern in time that explains a larger share of the energy precedes the conditions. By hand.
inline constexpr double kClearPattern = 0.6;
// Stretches of time, and how many times its part of the energy makes one stand out. By hand.
inline constexpr std::size_t kTimeBins = 24;
inline constexpr double kStandsOut = 1.25;
// A condition with so many times its part of the samples in energy is the cause. By hand.
inline constexpr double kTellingCondition = 1.5;

// say
// Two-sided 95 % of a Gaussian, standard deviations. By definition.
inline constexpr double k95 = 1.96;
// A smaller remaining share of the gap is not reported. By hand.
inline constexpr double kWorthSaying = 0.02;

}  // namespace loopwarden::gap
