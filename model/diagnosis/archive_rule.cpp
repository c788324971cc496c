// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/archive_rule.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "model/diagnosis/limits.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

double moves(std::span<const double> x) {
  std::vector<double> known = numeric::known(x);
  if (known.empty()) return 0.0;
  const double high = numeric::quantile_in_place(known, 0.95);
  return high - numeric::quantile_in_place(known, 0.05);
}

}  // namespace

double sees_from(std::span<const double> pv, std::span<const double> co, const Archived& archived) {
  if (!archived.any()) return 0.0;
  const double pv_moves = moves(pv);
  const double co_moves = moves(co);
  const double gain = co_moves > 0.0 ? pv_moves / co_moves : 0.0;
  const auto unknown = [](const analysis::ArchivedSignal& signal) {
    return signal.kind != analysis::ArchiveKind::none && !(signal.deviation > 0.0);
  };
  const bool known = !unknown(archived.pv) && !unknown(archived.co);
  if (!known || !(gain > 0.0)) return std::numeric_limits<double>::infinity();
  return 2.0 * std::max(archived.co.deviation, archived.pv.deviation / gain);
}

bool hidden(DiagnosisVerdict verdict, Cause cause, double size, double sees_from_co,
            double co_moves, double co_span) {
  if (!(sees_from_co > 0.0)) return false;
  if (verdict == DiagnosisVerdict::valve_effect) return size < sees_from_co;
  const bool looked =
      verdict == DiagnosisVerdict::healthy ||
      (verdict == DiagnosisVerdict::other_cause &&
       (cause == Cause::tuning || cause == Cause::disturbance || cause == Cause::none));
  return looked && (sees_from_co > Limits::kHideAllPercent / 100.0 * co_span ||
                    sees_from_co > Limits::kHideShareOfMoves * co_moves);
}

void mind_archive(Diagnosis& d, double sees_from_co, double co_span) {
  if (!hidden(d.verdict, d.cause, d.s, sees_from_co, moves(d.prepared.raw_co), co_span)) return;
  d.verdict = DiagnosisVerdict::cant_tell;
  d.grade = Grade::none;
  d.reason = kHiddenReason;
  d.settle = kHiddenSettle;
  d.testable = false;
}

void mind_archive(LoopVerdict& verdict, const Diagnosis& like, double sees_from_co,
                  double co_span) {
  if (!hidden(verdict.verdict, verdict.cause, like.s, sees_from_co, moves(like.prepared.raw_co),
              co_span)) {
    return;
  }
  verdict.verdict = DiagnosisVerdict::cant_tell;
  verdict.grade = Grade::none;
  verdict.reason = kHiddenReason;
  verdict.settle = kHiddenSettle;
  verdict.testable = false;
}

}  // namespace loopwarden::diagnosis
