// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/judged_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace loopwarden::protocol {
namespace {

using estimator::Observed;

// A record at a multiple of the test's period, or the same one.
std::optional<Observed> at_period(const TestRecord& test, double period_s) {
  const double ratio = period_s / test.period_s;
  const auto per = static_cast<std::size_t>(std::lround(ratio));
  if (per < 1 || std::abs(ratio - static_cast<double>(per)) > 0.01) return std::nullopt;
  Observed out{.period_s = period_s, .co = {}, .pv = {}, .used = {}};
  double last_co = 0.0;
  for (std::size_t k = 0; k + per <= test.pv.size(); k += per) {
    double pv = 0.0;
    for (std::size_t i = 0; i < per; ++i) {
      pv += test.pv[k + i] / static_cast<double>(per);
      if (std::isfinite(test.co[k + i])) last_co = test.co[k + i];
    }
    out.co.push_back(last_co);
    out.used.push_back(std::isfinite(pv));
    out.pv.push_back(std::isfinite(pv) ? pv : 0.0);
  }
  return out;
}

}  // namespace

JudgedTest judge_test(const TestPlanFile& plan, const TestRecord& test,
                      const record::Record& record, const plant::LoopModel& model,
                      const numeric::ParallelFor& parallel) {
  JudgedTest out;
  const TestRecord before{.period_s = record.period_s,
                          .time_s = record.time_s,
                          .sp = record.sp,
                          .pv = record.pv,
                          .co = record.co,
                          .stem = {}};
  const std::optional<Observed> of_record = at_period(before, record.period_s);
  const std::optional<Observed> of_test = at_period(test, record.period_s);
  if (record.co.empty() || !of_record || !of_test) {
    out.why_not = fmt::format("its period of {:g} s does not divide that of the record, {:g} s",
                              test.period_s, record.period_s);
    return out;
  }
  std::vector<std::vector<std::string>> names;
  for (const PlannedExplanation& e : plan.explanations) names.push_back(e.effects);
  estimator::Options how{.without = plan.without, .level_known = !plan.level_of_record};
  if (plan.level_of_record) how.without.emplace_back("leakage");
  out.judged = estimator::judge_test(names, *of_record, *of_test, model, how, parallel);
  return out;
}

Decision decision_of(const TestPlanFile& plan, const JudgedTest& test) {
  if (!test.judged || test.judged->decided < 0) return {};
  const auto i = static_cast<std::size_t>(test.judged->decided);
  return {title_of(plan.explanations[i].effects), test.judged->probability[i]};
}

std::string sentence_of(const TestPlanFile& plan, const JudgedTest& test) {
  if (!test.judged) return "The test is not judged: " + test.why_not + ".";
  const Decision decision = decision_of(plan, test);
  if (decision.name.empty()) {
    return fmt::format("The test does not decide between {}.", names_of(plan));
  }
  return fmt::format("The test decides: {}, with probability {:.2f}.", decision.name,
                     decision.probability);
}

Swing swing_of(const TestRecord& r) {
  Swing swing;
  std::size_t begin = 0;
  while (begin < r.time_s.size() && r.time_s[begin] < 0.0) ++begin;
  if (begin == 0 || begin == r.time_s.size()) return swing;
  for (std::size_t k = begin; k < r.time_s.size(); ++k) {
    if (std::isfinite(r.pv[k])) swing.pv = std::max(swing.pv, std::abs(r.pv[k] - r.sp[begin - 1]));
    if (std::isfinite(r.co[k])) swing.co = std::max(swing.co, std::abs(r.co[k] - r.co[begin - 1]));
  }
  return swing;
}

}  // namespace loopwarden::protocol
