// SPDX-License-Identifier: Apache-2.0
// Every limit by which `gap` decides, with where it comes from. Settings of the optimisers
// (populations, evaluations, grids) stand beside the optimisers: they cost time and precision, not
// names.
//
//   by definition  what the word means
//   by hand        set on development cases of lab/hidden_cases (seeds below 100000); never on the cases
//                  that judge it
#pragma once

#include <cstddef>

namespace loopwarden::gap {

// check
// ------------------------------------------------------------------------------------------------
// Shorter records are refused. By hand.
inline constexpr std::size_t kFewestSamples = 200;
// Less movement of CO, of its span, tells nothing of the valve. By hand.
inline constexpr double kLeastMovement = 0.01;
// A PV that changes less often stands still. By hand.
inline constexpr std::size_t kFewestMoves = 5;

// reading
// ---------------------------------------------------------------------------------------------- A
// PV that is renewed less often than that in the record shows no beat. By hand.
inline constexpr std::size_t kFewestRenewals = 20;
// Share of the changes that may come more than a sample off the beat: clocks slip. By hand.
inline constexpr double kOffBeat = 0.02;
// Where more of the changes are by the least one, the treads are rounding or a coarse valve. By
// hand.
inline constexpr double kEqualSteps = 0.5;
// Neighbours at the end of the range, and the share of them that stay there; of that, how many may
// stay elsewhere. By hand: noise of one rounding step leaves 0.28 of the neighbours equal.
inline constexpr std::size_t kFewestAtEnd = 8;
inline constexpr double kStaysAtEnd = 0.5;
inline constexpr double kStaysElsewhere = 0.1;
// An end of the reading this near to the transmitter's own, of its span, is that. By hand.
inline constexpr double kSameEnd = 0.005;
// A spike's jump, in the record's noise and of the transmitter's span (an archive hides the noise);
// how near to where it came from and to its top, of the jump; the longest, in samples. By hand.
inline constexpr double kSpikeNoise = 8.0;
inline constexpr double kSpikeSpan = 0.01;
inline constexpr double kSpikeNear = 0.3;
inline constexpr std::size_t kLongestSpike = 10;
// Fewer are skipped and said, and are no effect. By hand.
inline constexpr std::size_t kFewestSpikes = 3;
// A process that forgets faster than in so many samples can make a spike. By hand.
inline constexpr double kSpikeLag = 3.0;
// Of a name by flat readings. By hand: chance does not make them, but what fills up or limits a
// record is not always the transmitter.
inline constexpr double kReadingConfidence = 0.95;

// Of the transmitter's span: a PV so near to an end of it stands at the end. By hand.
inline constexpr double kAtEnd = 0.001;
// With fewer samples of the first two thirds that measure PV nothing is fitted. By hand.
inline constexpr std::size_t kFewestMeasured = 50;

// controller
// ------------------------------------------------------------------------------------------- Less
// rms of CO, of its span, does not matter. By hand: a converter's step of 12 bits is 0.00024.
inline constexpr double kLeastControllerRms = 0.002;
// Settings nearer to the model's than that, relative, are the model's. By hand.
inline constexpr double kSameSettings = 0.03;
// Other settings must leave less of the difference than that. By hand.
inline constexpr double kSettingsLeave = 0.3;
// With a filter on PV or a dead band no more may be left than that many times what matters, and
// less than such a part of what other gains alone leave. By hand: a controller's law is exact, and
// an error that is ignored explains much.
inline constexpr double kInletMatters = 2.0;
inline constexpr double kInletLeaves = 0.5;

// fit
//
// --------------------------------------------------------------------------------------------------
// What an effect moves PV by at least, rms: of the PV span, and of the record's noise. By hand.
inline constexpr double kLeastEffect = 0.0015;
inline constexpr double kLeastEffectNoise = 0.5;

// What a healthy valve leaves of PV beside noise, rms: of the output's span, times the process
// gain. By hand: its friction is allowed 0.3 %, and the stem rests anywhere within.
inline constexpr double kHealthyValveLeaves = 0.003;

// search
// -----------------------------------------------------------------------------------------------
// Nats to call one effect missing. By hand; it is a Bayes factor of 150, which Kass and Raftery, J.
// Am. Stat. Assoc. 90 (1995) 773-795, call very strong.
inline constexpr double kFirstGain = 5.0;
// Nats for each further one. By hand: the misfit of the first one's own law is taken for a second
// below.
inline constexpr double kFurtherGain = 12.0;
// Of the gap: a further effect that closes less is the first one's own misfit. By definition
// (gap.json).
inline constexpr double kLeastPart = 0.05;
// Student's t of the gain over the blocks of the record, each left out of the fit. By hand, a
// little below the one-sided 5 % of 11 degrees of freedom, 1.80.
inline constexpr double kLeastT = 1.7;
inline constexpr std::size_t kGainBlocks = 12;
// An effect that is more than a simpler one at less than this share of the samples is the simpler
// one. By hand.
inline constexpr double kLeastTelling = 0.005;
// Nats behind the choice: so near, and the record can't tell the names apart. By hand.
inline constexpr double kTooClose = 6.0;

// decide
// -----------------------------------------------------------------------------------------------
// What a hypothesis leaves counts as noise and a quiet load up to here. By hand.
inline constexpr double kMostNoiseRatio = 1.15;  // of the innovations' noise over the record's own
inline constexpr double kMostTail = 5.0;         // kurtosis of the innovations; Gaussian noise: 3
inline constexpr double kMostAnswer = 6.0;       // F ratio of the innovations on the moves of CO
// So large a share of the gap closed, and the name stands although more than noise is left. By
// hand.
inline constexpr double kEnoughClosed = 0.85;
// A PV that moves by less than so many noise floors has no fit percent. By definition (gap.json).
inline constexpr double kFewestFloors = 3.0;

// independence
// ----------------------------------------------------------------------------------------- Of the
// gap: less that follows SP is the misfit of the names that were given. By hand, as of a further
// effect.
inline constexpr double kFollowingPart = 0.05;
// Most confidence of a name where what is left follows SP or CO, and where that could not be
// tested. By definition.
inline constexpr double kMostFollowing = 0.7;
inline constexpr double kMostUntested = 0.8;
// ... and of one that is more than a simpler effect by a parameter whose interval holds 0. By
// definition.
inline constexpr double kMostLikeSimpler = 0.7;

// prove
// ------------------------------------------------------------------------------------------------
// Gap closed on the holdout = (before^2 - after^2)/(before^2 - floor^2). By definition (gap.json):
// where the model alone is nearer to the floor than kGapFloors floors there is no such figure; from
// kClosed on a name is given as it is, from kPartlyClosed on with no more than kPartlyConfidence,
// below it is taken back.
inline constexpr double kGapFloors = 2.0;
inline constexpr double kClosed = 0.8;
inline constexpr double kPartlyClosed = 0.5;
inline constexpr double kPartlyConfidence = 0.89;
// Where there is no such figure: the innovations on the holdout may be so much larger, squared,
// than those of the model alone. By hand: what shows only before the holdout can't be better there.
inline constexpr double kWorstInnovations = 1.05;
// ... and where more than noise is left, the free run's holdout rmse must fall to this part. By
// hand.
inline constexpr double kWorstHoldout = 0.8;

// learn
// ------------------------------------------------------------------------------------------------
// A form with fewer numbers may leave so many times the least on the blocks left out, squared. By
// hand.
inline constexpr double kAsGood = 1.2;
// By so much more of the gap on blocks left out a law ousts names: on all together, or on so many
// of those with a gap. By definition.
inline constexpr double kOusts = 0.2;
inline constexpr double kOustsOn =
    2.0 / 3.0;  // also of the blocks on which a gain that wanders on must be ahead
// Most confidence of what was learned: it has no name that could be right. By hand.
inline constexpr double kMostLearned = 0.89;

// locate
// ----------------------------------------------------------------------------------------------- A
// pattern in time that explains more of the energy stands before the conditions. By hand.
inline constexpr double kClearPattern = 0.6;
// Stretches of time, and by how much more than their part of the energy makes one stand out. By
// hand.
inline constexpr std::size_t kTimeBins = 24;
inline constexpr double kStandsOut = 1.25;

// By so much more energy than its part of the samples, and a condition stands for the cause. By
// hand.
inline constexpr double kTellingCondition = 1.5;

// say
//
// --------------------------------------------------------------------------------------------------
// Two-sided 95 % of a Gaussian, standard deviations. By definition.
inline constexpr double k95 = 1.96;
// A delay that is this near to a multiple of the time between two moves of SP, as a part of that
// time, and the most confidence of a name that has it. By hand.
inline constexpr double kRepeats = 0.1;
inline constexpr double kMostRepeating = 0.5;
// Of the output's span: a larger effect of a valve is more likely an error of the model, and its
// name has at most this confidence. By hand.
inline constexpr double kLargeValveEffect = 0.3;
inline constexpr double kMostLarge = 0.5;
// A smaller share of the gap that is left is not worth a sentence. By hand.
inline constexpr double kWorthSaying = 0.02;

}  // namespace loopwarden::gap
