// SPDX-License-Identifier: Apache-2.0
// Constants that decide the detectors of a running loop.
// Source: chosen by hand on simulated loops, unless a line names another. `loopwarden-study alarm`
// measures windows and routine evidence. No study measures the watches of twin, controller and
// disturbance; tests/model/watch has their simulated loops.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace loopwarden::watch {

struct WatchLimits {
  // Windows.
  static constexpr std::size_t kLongestBridge = 4;        // samples: 0.4 s of 96 s
  static constexpr std::size_t kMostBridged = 9;          // samples: 1 % of a window
  static constexpr double kMostOverlap = 0.95;            // of a window
  static constexpr std::size_t kMostDecimation = 10'000;  // cycles per sample
  static constexpr double kMostSaturated = 10.0;          // % of a window's samples
  static constexpr std::uint64_t kStemLagBlocks = 24;  // per window, for the lag of the stem: 4 s

  // Routine evidence. One window at the highest probability of diagnose() is not enough to raise,
  // and two are.
  static constexpr std::array kRoutineSampleTimes_s{1.0, 4.0, 16.0, 64.0};
  static constexpr std::size_t kRoutineSamples = 750;
  static constexpr std::size_t kLongestBreak = 4;      // samples
  static constexpr double kLeastProbability = 0.05;    // limits one window to 2.9 nats
  static constexpr double kDrift = 0.3;                // nats per window
  static constexpr double kRaise = 3.0;                // nats
  static constexpr double kClear = 0.5;                // nats
  static constexpr double kMostEvidence = 6.0;         // nats
  static constexpr double kMostFromSpecialists = 1.5;  // nats
  static constexpr double kHealthyBand = 0.3;  // % of the CO span; positioners state 0.1 to 0.3
  static constexpr double kMostAreNew = 0.5;   // of the samples: the source keeps every value

  // All watches of a twin.
  static constexpr double kSlack = 1.5;             // times the largest of the healthy record
  static constexpr double kQuiet_s = 900.0;         // below kQuietShare of the limit, to clear
  static constexpr double kQuietShare = 0.25;       // of the limit
  static constexpr double kBlockAnswers = 0.5;      // answers of the loop
  static constexpr std::size_t kFewestInBlock = 5;  // samples

  // Twin.
  static constexpr double kTwinAlarm = 25.0;         // z
  static constexpr double kOutside = 0.25;           // of the healthy range of PV or CO
  static constexpr double kUnsure = 16.0;            // spread per healthy range beyond it
  static constexpr double kAgain = 2.0;              // answers
  static constexpr std::size_t kAgainSamples = 10;   // in addition
  static constexpr double kWarmUp = 5.0;             // answers
  static constexpr std::size_t kWarmUpSamples = 50;  // in addition
  static constexpr double kShort = 3.0;              // answers, until z has forgotten
  static constexpr double kLong_s = 1200.0;          // the same
  static constexpr double kTested = 2.0;             // times a change of TwinChange
  static constexpr double kForgets_s = 900.0;        // an offset outside of the model
  static constexpr double kMoreLoad = 4.0;           // times that of the healthy record
  static constexpr double kFastest = 10.0;           // of the answer
  static constexpr double kVarianceAnswers = 60.0;   // answers
  static constexpr double kMostOfNoise = 36.0;       // largest n^2 for v, over that of noise
  static constexpr double kMostSigmas = 8.0;         // largest n for z: an outlier is no change
  static constexpr double kMoreThanNoise = 1.1;      // least v over the noise
  static constexpr double kHealthyFriction = 0.001;  // of the CO span
  static constexpr double kJumpSigmas = 6.0;         // of a disturbance
  static constexpr double kMostChange = 10.0;        // times a change of TwinChange: it jumps
  static constexpr std::size_t kJumpSamples = 3;     // in a row: one or two are outliers
  static constexpr std::uint64_t kMostMissed = 100;  // cycles that the twin bridges

  // Changes of TwinChange, and the least spread that a healthy plant has.
  static constexpr double kChangedGain = 0.1;        // of the gain
  static constexpr double kChangedTimes = 0.2;       // of lags, dead time and answer
  static constexpr double kChangedValve = 0.02;      // of the CO span
  static constexpr double kLeastLater_s = 0.3;       // of the dead time
  static constexpr double kLeastLaterSamples = 3.0;  // the same
  static constexpr double kGainSpread = 0.02;        // of the gain
  static constexpr double kTimeSpread = 0.04;        // of the lags
  static constexpr double kDeadTimeSpread = 0.03;    // of the dead time
  static constexpr double kLeastDeadTimeSpread_s = 0.1;
  static constexpr double kLagSpread = 0.1;       // of the changed lag
  static constexpr double kFrictionSpread = 1.5;  // times kHealthyFriction

  // Controller.
  static constexpr double kWithin = 2.0;            // resolutions
  static constexpr double kLimit = 3.0;             // mean n^2/N^2 of a block
  static constexpr double kMostInBlock = 5.0;       // S
  static constexpr double kControllerAlarm = 20.0;  // S
  static constexpr double kQuarterHigher = 1.25;    // gains whose detection is tested
  static constexpr double kFinest = 1.0 / 4096.0;   // of the CO span

  // Disturbance.
  static constexpr double kMinutes_s = 60.0;
  static constexpr double kHours_s = 3600.0;
  static constexpr double kDeviations = 5.0;     // standard deviations
  static constexpr double kLeastOutside = 0.01;  // of the PV span
  static constexpr double kBack = 0.7;           // of the limit
  static constexpr double kStands_s = 1800.0;    // longest step
  static constexpr double kLoadTime_s = 300.0;   // a random disturbance is forgotten
  static constexpr double kHealthy_s = 1200.0;   // least length of the healthy record
  static constexpr double kNotJudged_s = 600.0;  // until the journal reports it
};
using Limits = WatchLimits;  // in this folder

}  // namespace loopwarden::watch
