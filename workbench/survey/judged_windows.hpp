// SPDX-License-Identifier: Apache-2.0
// What is judged of a loop's record: stretches of one length that the record itself sets, so that no window that a user asks
// for changes a verdict. A stretch holds 15 periods of movement and 1500 samples at the least, and a record below twice that
// is one stretch.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/kind.hpp"
#include "record/record_csv.hpp"
#include "workbench/text/diagnose_text.hpp"

namespace loopwarden::workbench {

struct Stretch {
  std::size_t from;  // samples
  std::size_t size;
};

std::vector<Stretch> stretches_of(const record::Record& r);

// A column's part; empty where the record does not have it.
inline std::span<const double> part_of(bool has, const std::vector<double>& column,
                                       Stretch stretch) {
  return has ? std::span(column).subspan(stretch.from, stretch.size) : std::span<const double>();
}

// One stretch by itself. `r`: without its samples in manual.
DiagnosedWindow judge_stretch(const record::Record& r, Stretch stretch, diagnosis::LoopKind kind,
                              const std::vector<double>& co_range,
                              const diagnosis::Archived& archived);

// Each window of the loop once more with how CO turns in all of them, minded by what its archive left out; then one verdict of
// all. The diagnoses are returned in the windows' order. `imports` of the loop must be there.
std::vector<diagnosis::Diagnosis> judge_together(DiagnosedLoop& loop);

// Of some of the windows that judge_together has returned.
diagnosis::LoopVerdict verdict_of(const DiagnosedLoop& loop,
                                  const std::vector<diagnosis::Diagnosis>& each, std::size_t first,
                                  std::size_t count);

}  // namespace loopwarden::workbench
