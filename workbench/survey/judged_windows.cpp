// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/judged_windows.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "model/diagnosis/diagnosis.hpp"
#include "workbench/command_line/frame.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::size_t kLeastStretch = 1500;  // samples
constexpr double kStretchMovements = 15.0;   // periods
constexpr std::size_t kMostSamples = 30000;  // of a stretch: about a second of work
constexpr std::size_t kLookedAt = 60000;     // samples, for the period

std::size_t stretch_length(const record::Record& r) {
  if (r.size() < 2 * kLeastStretch) return r.size();
  const std::size_t looked = std::min(r.size(), kLookedAt);
  const auto from = static_cast<std::ptrdiff_t>((r.size() - looked) / 2);
  const auto to = from + static_cast<std::ptrdiff_t>(looked);
  std::vector<double> pv(r.pv.begin() + from, r.pv.begin() + to);
  std::vector<double> co(r.co.begin() + from, r.co.begin() + to);
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (std::isfinite(pv[k]) && std::isfinite(co[k])) continue;
    pv[k] = k > 0 ? pv[k - 1] : 0.0;
    co[k] = k > 0 ? co[k - 1] : 0.0;
  }
  const double length = std::max(static_cast<double>(kLeastStretch),
                                 kStretchMovements * diagnosis::judged_period(pv, co));
  return static_cast<std::size_t>(
      std::min({length, static_cast<double>(kMostSamples), static_cast<double>(r.size())}));
}

}  // namespace

std::vector<Stretch> stretches_of(const record::Record& r) {
  const std::size_t length = std::max<std::size_t>(1, stretch_length(r));
  const std::size_t count = std::max<std::size_t>(1, r.size() / length);
  std::vector<Stretch> stretches;
  for (std::size_t w = 0; w < count; ++w) {
    const std::size_t from = r.size() * w / count;
    stretches.push_back({from, r.size() * (w + 1) / count - from});
  }
  return stretches;
}

DiagnosedWindow judge_stretch(const record::Record& r, Stretch stretch, diagnosis::LoopType kind,
                              const std::vector<double>& co_range,
                              const diagnosis::Archived& archived) {
  numeric::LoopView part = r.view().part(stretch.from, stretch.from + stretch.size);
  part.co_low = co_range[0];
  part.co_high = co_range[1];
  DiagnosedWindow window;
  window.from_s = r.time_s[stretch.from];
  window.to_s = r.time_s[stretch.from + stretch.size - 1];
  window.period_s = r.period_s;
  window.diagnosis = diagnosis::diagnose(part, kind);
  window.sees_from = diagnosis::sees_from(part.pv, part.co, archived);
  return window;
}

diagnosis::LoopVerdict verdict_of(const DiagnosedLoop& loop,
                                  const std::vector<diagnosis::Diagnosis>& each, std::size_t first,
                                  std::size_t count) {
  diagnosis::LoopVerdict verdict = diagnosis::judge_loop(std::span(each).subspan(first, count));
  verdict.like += first;
  verdict.since += first;
  const DiagnosedWindow& like = loop.windows[verdict.like];
  diagnosis::mind_archive(verdict, each[verdict.like], like.sees_from,
                          loop.co_range[1] - loop.co_range[0]);
  return verdict;
}

std::vector<diagnosis::Diagnosis> judge_together(DiagnosedLoop& loop) {
  std::vector<diagnosis::Diagnosis*> together;
  for (DiagnosedWindow& w : loop.windows) together.push_back(&w.diagnosis);
  diagnosis::share_reversals(together);
  std::vector<diagnosis::Diagnosis> each;
  each.reserve(loop.windows.size());
  for (DiagnosedWindow& w : loop.windows) {
    diagnosis::mind_archive(w.diagnosis, w.sees_from, loop.co_range[1] - loop.co_range[0]);
    each.push_back(w.diagnosis);
  }
  loop.verdict = verdict_of(loop, each, 0, each.size());
  return each;
}

void plan_test(DiagnosedLoop& loop) {
  if (!loop.verdict.testable) return;
  const DiagnosedWindow& like = loop.windows[loop.verdict.like];
  diagnosis::TestedLoop about{.period_s = like.period_s,
                              .outputs = {loop.co_range[0], loop.co_range[1]}};
  if (const auto& range = loop.imports[like.import].ranges[index_of(record::Role::pv)]) {
    about.pv_range = {range->first, range->second};
  }
  loop.test = diagnosis::plan_deciding_test(like.diagnosis, about, on_threads(1));
}

}  // namespace loopwarden::workbench
