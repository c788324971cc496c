// SPDX-License-Identifier: Apache-2.0
// Finds a valve effect or another cause from a routine record, without a model. The steps are
// preparation and gates, the evidence on the valve, the decision (decision.hpp), and the other
// possible causes.
//
// A loop with several windows gets one verdict: the mean of the windows' logits decides, so a
// single odd window does not.
//
// Limits and figures: docs/explanation/accuracy.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "model/diagnosis/classifier.hpp"
#include "model/diagnosis/decision.hpp"
#include "model/diagnosis/loop_type.hpp"
#include "model/diagnosis/preparation.hpp"
#include "model/estimator/band.hpp"

namespace loopwarden::diagnosis {

enum class DiagnosisVerdict : std::uint8_t {
  valve_effect,
  other_cause,
  healthy,
  not_enough_data,
  cant_tell
};
const char* to_text(DiagnosisVerdict verdict) noexcept;

struct Diagnosis {
  DiagnosisVerdict verdict = DiagnosisVerdict::not_enough_data;
  Grade grade = Grade::none;  // of a valve effect
  std::string reason;     // why there is no verdict on the valve: not_enough_data, cant_tell, gates
  std::string settle;     // the remedy
  bool testable = false;  // undecided, and a move of CO can decide (deciding_test.hpp)
  LoopType loop_type = LoopType::unknown;
  double probability = 0.5;  // of a valve effect
  ValveEvidence evidence;
  estimator::BandEvidence band;
  Cause cause = Cause::none;        // the effect, or the cause of the oscillation
  Cause alternative = Cause::none;  // the other valve effect, if it can't be excluded
  double stiction_share = 1.0;      // of `probability`
  bool oscillating = false;
  double period_s = 0.0;  // 0 if not oscillating
  double s = 0.0;         // CO units, of a valve effect: band of the stiction or the backlash
  double s_low = 0.0;     // CO units, s is within them in nine of ten cases
  double s_high = 0.0;
  Prepared prepared;

  bool judged() const noexcept {
    return prepared.gate == Gate::open && verdict != DiagnosisVerdict::not_enough_data;
  }
};

Diagnosis diagnose(const numeric::LoopView& record, LoopType type = LoopType::unknown);

// Returns the time scale in samples: the cycle if one stands out, otherwise the movement. A window
// of fifteen of them can be judged.
double judged_period(std::span<const double> pv, std::span<const double> co);

// Judges each window of one loop again with the turns of CO in all of them, since a window has few
// turns.
void share_reversals(std::span<Diagnosis*> windows);

// One verdict from all windows of a loop, in the order of time.
struct LoopVerdict {
  DiagnosisVerdict verdict = DiagnosisVerdict::not_enough_data;
  Grade grade = Grade::none;
  Cause cause = Cause::none;
  double probability = 0.5;
  std::string reason;
  std::string settle;
  bool testable = false;  // as in Diagnosis; also of a likely effect
  std::size_t like =
      0;  // the window most like the verdict; its size and evidence represent the loop
  std::size_t since =
      0;  // for a valve effect: the first of the unbroken row of windows with it up to the last
};
// Size of the effect over the windows that show it, in the order of time: median of the slopes
// between all pairs (P. K. Sen, J. Am. Stat. Assoc. 63, 1968).
struct SizeTrend {
  std::size_t windows = 0;  // that show the effect
  double first = 0.0;       // CO units
  double last = 0.0;
  double per_window = 0.0;
};
SizeTrend size_trend(std::span<const Diagnosis> windows);
LoopVerdict judge_loop(std::span<const Diagnosis> windows);

}  // namespace loopwarden::diagnosis
