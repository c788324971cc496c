// SPDX-License-Identifier: Apache-2.0
#include "model/gap/sample_time.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

constexpr double kAlike = 0.01;  // of the shorter period
constexpr double kMost = 20.0;
constexpr double kMostConfidence = 0.85;

// How many of the shorter period the longer one is; 0: not a whole number.
std::size_t whole_ratio(double longer_s, double shorter_s) {
  const double ratio = longer_s / shorter_s;
  const double whole = std::nearbyint(ratio);
  return whole >= 2.0 && whole <= kMost && std::abs(ratio - whole) <= kAlike
             ? static_cast<std::size_t>(whole)
             : 0;
}

std::vector<double> every(const std::vector<double>& column, std::size_t n) {
  std::vector<double> out;
  for (std::size_t k = 0; k < column.size(); k += n) out.push_back(column[k]);
  return out;
}

}  // namespace

std::optional<OnePeriod> on_one_period(const LoopRecord& record, const plant::LoopModel& model,
                                       bool co_in_lines) {
  if (!(record.period_s > 0.0) || !(model.sample_time_s > 0.0)) return std::nullopt;
  OnePeriod out{record, model};
  if (record.pv_as_stored && std::abs(record.period_s - model.sample_time_s) >
                                 kAlike * std::min(record.period_s, model.sample_time_s)) {
    out.model.sample_time_s = record.period_s;
    return out;
  }
  if (const std::size_t n = whole_ratio(record.period_s, model.sample_time_s); n > 0) {
    out.model.sample_time_s = record.period_s;
    const double ahead = 0.5 * static_cast<double>(n - 1) / static_cast<double>(n);
    std::vector<double>& co = out.record.co;
    for (std::size_t k = 0; co_in_lines && k + 1 < co.size(); ++k) {
      if (std::isfinite(co[k + 1])) co[k] += ahead * (co[k + 1] - co[k]);
    }
    return out;
  }
  const std::size_t n = whole_ratio(model.sample_time_s, record.period_s);
  if (n == 0) return std::nullopt;
  out.record.period_s = model.sample_time_s;
  out.record.pv = every(record.pv, n);
  out.record.sp = every(record.sp, n);
  out.record.stem = every(record.stem, n);
  out.record.co.clear();
  for (std::size_t k = 0; k < record.co.size(); k += n) {
    const std::size_t end = std::min(k + n, record.co.size());
    double sum = 0.0;
    for (std::size_t i = k; i < end; ++i) sum += record.co[i];
    out.record.co.push_back(sum / static_cast<double>(end - k));
  }
  return out;
}

void say_other_period(Result& result, const plant::LoopModel& given, double record_period_s) {
  result.model.sample_time_s = given.sample_time_s;
  result.corrected.sample_time_s = given.sample_time_s;
  result.adjusted.sample_time_s = given.sample_time_s;
  for (FoundEffect& effect : result.effects)
    effect.confidence = std::min(effect.confidence, kMostConfidence);
  result.check.notes.push_back(
      {"sample_time",
       text("The record has a sample every %g s, the model every %g s: what CO did between "
            "its samples is not known, and the controller is not compared.",
            record_period_s, given.sample_time_s)});
}

}  // namespace loopwarden::gap
