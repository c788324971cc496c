// SPDX-License-Identifier: Apache-2.0
// Splits a loop's record into stretches and judges them. The record sets the length of the
// stretches, so the user's choice of windows can't change a verdict. A stretch has at least 15
// periods of movement and 1500 samples. A record shorter than two such stretches is one stretch.
#pragma once

#include <cstddef>
#include <vector>

#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/loop_type.hpp"
#include "record/record_csv.hpp"
#include "workbench/text/diagnose_text.hpp"

namespace loopwarden::workbench {

struct Stretch {
  std::size_t from;  // samples
  std::size_t size;
};

std::vector<Stretch> stretches_of(const record::Record& r);

// Judges one stretch separately. `r`: without its samples in manual.
DiagnosedWindow judge_stretch(const record::Record& r, Stretch stretch, diagnosis::LoopType kind,
                              const std::vector<double>& co_range,
                              const diagnosis::Archived& archived);

// Judges each window of the loop again, using how CO reverses in all windows and which values its
// archive left out. Then forms one verdict of all. Returns the diagnoses in the order of the
// windows. `imports` of the loop must be set.
std::vector<diagnosis::Diagnosis> judge_together(DiagnosedLoop& loop);

// Plans the test that decides, for a likely or undecided valve.
void plan_test(DiagnosedLoop& loop);

// Returns the verdict of some of the windows that judge_together has returned.
diagnosis::LoopVerdict verdict_of(const DiagnosedLoop& loop,
                                  const std::vector<diagnosis::Diagnosis>& each, std::size_t first,
                                  std::size_t count);

}  // namespace loopwarden::workbench
