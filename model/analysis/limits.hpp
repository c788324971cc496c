// SPDX-License-Identifier: Apache-2.0
// Constants that decide the analyses of a record.
// Source: chosen by hand on the records of examples/ and on simulated loops, unless a line or a
// section names another. `loopwarden-study identify` measures the law, identification and sticking
// cycle, and lab/bench/archive_study.py the archive. No study measures the others. Search grids and
// numerical accuracy are in the sources.
#pragma once

#include <array>
#include <cstddef>

namespace loopwarden::analysis {

struct AnalysisLimits {
  // Archive.
  static constexpr std::size_t kLeastStored = 20;    // values
  static constexpr double kStoredAll = 0.8;          // stored share of a complete record
  static constexpr std::size_t kLeastAtOnce = 8;     // values that were followed immediately
  static constexpr double kAtOnceScale = 1.0 / 0.9;  // deviation over their 5 % quantile
  // 5 % quantile over median of the distances: 0.1 without a rule, 0.5 after a swinging door.
  static constexpr double kAnyValue = 0.33;
  static constexpr double kAllScale = 0.9;         // deviation over the quartile of all distances
  static constexpr double kOnLine = 0.15;          // share of the samples of a filled record
  static constexpr double kRising = 4.0;           // tolerances in two samples
  static constexpr double kRepeated = 0.55;        // share of the samples of a filled record
  static constexpr std::size_t kFewLevels = 4;     // samples per distinct value
  static constexpr int kMostDigits = 9;            // decimals of a written file
  static constexpr double kEqualIntervals = 0.05;  // coefficient of variation: held measurement
  static constexpr double kJoined = 0.2;           // share of the intervals of a held measurement
  static constexpr double kFewMultiples = 8.0;     // times the smallest step
  static constexpr double kMultiples = 0.9;        // share of the steps: a resolution
  static constexpr double kLevelsOfSteps = 0.5;    // distinct levels per step: few
  static constexpr double kLevelStep = 1.5;        // distances of levels: steps of a resolution
  static constexpr double kFewLevelsStep = 2.5;    // the same for few levels
  static constexpr double kLastDigits = 1.5;       // times the last digit: rounding

  // Law of the controller.
  static constexpr std::size_t kLawLags = 3;        // samples
  static constexpr double kFeedbackShare = 0.3;     // of the variance: closed loop
  static constexpr double kJump = 8.0;              // robust standard deviations
  static constexpr std::size_t kMostRows = 50'000;  // evenly spread over a long record
  static constexpr std::size_t kFewestLawRows = 30;
  static constexpr double kRunsAway = 20.0;           // times the range of CO in the record
  static constexpr double kMostMoving = 0.5;          // share of the rows in which CO moves
  static constexpr std::size_t kFewestSwitches = 8;   // up, and as many down
  static constexpr double kOnTime = 0.9;              // share of the switches within kRowsOff
  static constexpr std::size_t kRowsOff = 2;          // rows
  static constexpr double kApart = 0.97;              // share of pairs (up, down): PV lower at up
  static constexpr double kLeastMoving = 0.3;         // share of the rows beyond the gap
  static constexpr double kSameWay = 0.5;             // correlation of moves of CO with later PV
  static constexpr double kSomeWay = 0.1;             // the same with earlier PV
  static constexpr std::size_t kFewestSetPoints = 3;  // moves of SP
  static constexpr double kAnswered = 0.8;            // share that CO follows within kRowsOff
  static constexpr double kByChance = 0.4;            // largest share followed by chance

  // Identification.
  static constexpr std::size_t kFewestSamples = 30;
  static constexpr std::size_t kMostSamples = 20'000;
  static constexpr std::size_t kFewestMoves = 60;    // of CO; fewer show no period
  static constexpr double kMostOutsideMargin = 0.2;  // share of the gain
  static constexpr double kMostFactor = 2.0;         // from the gain to the ends of its interval
  static constexpr double kSamplesPerLag = 20.0;     // that a thinned record keeps
  static constexpr double kHalf = 0.5;               // of the error of a line, or of another fit
  static constexpr std::size_t kMostLate = 3;        // samples, delay of CO in the log
  static constexpr double kFarBetter = 0.8;          // of the sum of squares
  static constexpr double kSlowLogging = 3.0;        // periods: shorter lags are uncertain
  static constexpr double kLagFactor = 2.0;          // by this factor
  static constexpr double kUnderstood = 0.5;         // of CO's variance: the PI law is known
  static constexpr double kSpanOverBand = 4.0;       // least range of CO over the band of a cycle
  static constexpr std::size_t kMostNoiseOrder = 3;
  static constexpr double kLongestDeadTime = 0.35;  // share of the record
  static constexpr double kShortestLag = 0.05;      // share of a period
  static constexpr double kLongestLag = 20.0;       // times the record
  // Gain over the travel.
  static constexpr std::size_t kFewestRestRows = 12;  // per rest; its last third counts
  static constexpr std::size_t kFewestRests = 8;
  static constexpr std::size_t kFewestLevels = 5;  // of CO
  static constexpr double kBentGain = 1.5;         // from one end of the travel to the other
  static constexpr double kBentLeaves = 0.25;      // share of the squared error of one gain
  // Slips of a measured stem.
  static constexpr double kSlipNoise = 6.0;    // robust standard deviations of its moves
  static constexpr double kLeastSlip = 1e-3;   // share of its range
  static constexpr std::size_t kSlipRest = 3;  // samples
  static constexpr std::size_t kFewestSlips = 6;

  // Sticking cycle. On the records of examples/ without friction the lead was below 0, or the lag
  // reached its upper limit. With friction it was 86 to 764 nats in seven of ten.
  static constexpr std::size_t kFewestCycleSamples = 100;
  static constexpr std::size_t kMostCycleSamples = 6000;
  static constexpr std::size_t kFewestReversals = 6;  // of CO: three cycles
  static constexpr std::size_t kFewestStemReversals = 4;
  static constexpr double kReversalBand = 0.3;       // of the range of CO
  static constexpr double kStemReversalBand = 0.02;  // of the range of the stem
  static constexpr double kLeastLead = 30.0;         // nats
  static constexpr double kLeastBand = 0.2;          // s over the range of CO
  static constexpr double kLeastT = 1.7;             // Student's t of the lead over blocks
  static constexpr double kLongestLagPlace = 0.95;   // of the searched range: not a lag
  static constexpr std::size_t kBlocks = 12;
  static constexpr double kProfile = 3.84;  // chi-squared, one degree of freedom, 95 %

  // Choice of a stretch.
  static constexpr std::size_t kStretchBlock = 16;  // samples that are averaged

  // Condition indices: the values of index 0.
  static constexpr double kPerformanceLimit = 5.0;  // % of the PV range
  static constexpr double kStickLimit = 10.0;       // % of the CO range
  static constexpr double kStemLagLimit = 30.0;     // s
  static constexpr double kDeviationLimit = 3.0;    // % of the CO range
  static constexpr double kBadShareLimit = 0.1;     // of the time
  static constexpr double kCycleLimit = 0.02;       // of the cycles

  // Tests and tuning.
  static constexpr double kPeriodsAgree = 0.05;    // of a relay test
  static constexpr int kFewestPeriods = 3;         // the same
  static constexpr double kMostSensitivity = 2.0;  // Åström and Hägglund (2006), section 4.6
  static constexpr std::array kStudySizes{0.1, 0.2, 0.5, 1.0, 2.0, 5.0};  // % of the output range
  static constexpr int kScanPoints = 21;
  static constexpr int kRampSteps = 10;
  static constexpr std::array kSinePeriods_s{64.0, 32.0, 16.0, 8.0};
  static constexpr int kSineCycles = 3;
};
using Limits = AnalysisLimits;  // in this folder

}  // namespace loopwarden::analysis
