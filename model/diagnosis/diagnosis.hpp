// SPDX-License-Identifier: Apache-2.0
// What is wrong with a loop, from routine data alone: PV and CO, SP where it is known.
//
// The record is prepared (preparation.hpp), evidence of many kinds is measured (evidence.hpp) and weighed
// (classifier.hpp), on the whole record and, with less weight, on its first and last kPart: what only an
// upset or a spell shows counts less. A valve effect is named when its probability reaches kValveThreshold; among the
// rest, an oscillation is put down to the most probable other cause.
//
// What it can't do: name a sticking valve that did not move, or one behind a load much larger than its
// band; tell the valve from another part of the loop that sticks; name two causes at once.
#pragma once

#include <cstdint>
#include <string>

#include "model/diagnosis/classifier.hpp"
#include "model/diagnosis/preparation.hpp"
#include "model/diagnosis/valve_fit.hpp"

namespace loopwarden::diagnosis {

enum class Verdict : std::uint8_t { valve_effect, other_cause, healthy, not_enough_data };
const char* to_text(Verdict verdict) noexcept;

// Of the probability that the valve has an effect, stiction and backlash together. Chosen on simulated
// loops for few false alarms (docs/diagnose.md).
inline constexpr double kValveThreshold = 0.7;

inline constexpr double kPart = 0.55;        // of the record
inline constexpr double kPartWeight = 0.35;  // against 1 for the whole
// The looks are of one record, yet not the same: their mean is less sure than they deserve.
inline constexpr double kSharpening = 1.25;
// Stiction and backlash look alike in routine data, and a self-regulating loop seldom cycles from backlash:
// it is named where it is this many times more probable.
inline constexpr double kBacklashOdds = 2.0;

// The fit puts the band too low, as it can trade it for dead time; the range of CO puts it too high, as CO
// overshoots the band. Their geometric mean is right in the median of simulated loops, and in nine of ten
// within this factor (`loopwarden diagnose-study`).
inline constexpr double kSizeFactor = 1.5;

struct Diagnosis {
  Verdict verdict = Verdict::not_enough_data;
  std::string reason;  // why there is not enough data; empty otherwise
  CauseProbabilities probabilities{};
  Cause cause = Cause::none;        // the effect, or the cause of the oscillation
  Cause alternative = Cause::none;  // the other valve effect, where it can't be excluded
  bool oscillating = false;
  double period_s = 0.0;  // 0 where not oscillating
  bool integrating = false;
  double s = 0.0;      // CO units, of a valve effect: band of the stiction or the backlash
  double j = 0.0;      // CO units, slip jump
  double s_low = 0.0;  // CO units, s is within them in nine of ten cases
  double s_high = 0.0;
  Prepared prepared;
  Findings findings;
};

Diagnosis diagnose(const RoutineRecord& record);

}  // namespace loopwarden::diagnosis
