// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/next_test_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "workbench/text/posterior_bars.hpp"

namespace loopwarden::workbench {
namespace {

using estimator::MoveKind;
using estimator::TestPlan;

std::string time_text(double seconds) {
  return seconds < 120.0 ? fmt::format("{:.0f} s", seconds)
                         : fmt::format("{:.0f} min", std::ceil(seconds / 60.0));
}

}  // namespace

std::string competing_names(const gap::NextTest& test) {
  std::string names;
  for (std::size_t i = 0; i < test.explanations.size(); ++i) {
    const bool last = i + 1 == test.explanations.size();
    names += (i == 0 ? "" : last ? " or " : ", ") + title_of(test.explanations[i].effects);
  }
  return names;
}

std::string test_sentence(const TestPlan& plan) {
  const bool manual = estimator::in_manual(plan.move.kind);
  const double from = plan.moved.back();
  const std::string what = manual ? "In manual, move the output" : "In automatic, move SP";
  const char* unit = manual ? "CO units" : "PV units";
  const double to = from + plan.move.size;
  const std::string there = fmt::format("{} from {:.4g} to {:.4g} {}", what, from, to, unit);
  const std::string hold = time_text(plan.move.hold_s);
  switch (plan.move.kind) {
    case MoveKind::set_point_stairs:
    case MoveKind::output_stairs:
      return fmt::format("{} in three equal steps and back in three, each for {}.", there, hold);
    case MoveKind::set_point_ramp:
    case MoveKind::output_ramp:
      return fmt::format("{} at one rate within {}, back within {}, then wait for {}.", there, hold,
                         hold, hold);
    case MoveKind::set_point_reversal:
    case MoveKind::output_reversal:
      return fmt::format("{} for {}, then to {:.4g} {} for {}, then back for {}.", there, hold,
                         from - plan.move.size, unit, hold, hold);
    default: return fmt::format("{} for {}, then back for {}.", there, hold, hold);
  }
}

std::string expected_sentence(const TestPlan& plan) {
  return fmt::format(
      "It decides rightly with probability {:.2f} and wrongly with {:.2f}, takes {}, and moves PV "
      "by at most {:.3g} PV units and CO by {:.3g} CO units.",
      plan.probability_right, plan.probability_wrong, time_text(plan.duration_s), plan.pv_swing,
      plan.output_swing);
}

std::vector<std::array<double, 2>> outcomes_of(const TestPlan& plan) {
  std::vector<std::array<double, 2>> changes;
  for (const estimator::Predicted& predicted : plan.predicted) {
    const std::vector<double>& pv = predicted.middle;
    const double from = pv.front();
    const double farthest = *std::max_element(pv.begin(), pv.end(), [&](double a, double b) {
      return std::abs(a - from) < std::abs(b - from);
    });
    changes.push_back({farthest - from, pv.back() - from});
  }
  return changes;
}

const char* allowed_by(double pv_share) {
  return pv_share <= 0.01 ? "technician" : pv_share <= 0.03 ? "operator" : "test day";
}

std::string decision_sentence(const gap::NextTest& test) {
  const TestPlan& plan = test.plan;
  // The moment at which the explanations differ most.
  std::size_t telling = 0;
  double most = -1.0;
  for (std::size_t k = 0; k < plan.time_s.size(); ++k) {
    double low = plan.predicted.front().middle[k];
    double high = low;
    for (const estimator::Predicted& one : plan.predicted) {
      low = std::min(low, one.middle[k]);
      high = std::max(high, one.middle[k]);
    }
    if (high - low > most) {
      most = high - low;
      telling = k;
    }
  }
  std::string names;
  std::string outcomes;
  for (std::size_t i = 0; i < test.explanations.size(); ++i) {
    const std::string name = title_of(test.explanations[i].effects);
    names += (i == 0 ? "" : i + 1 == test.explanations.size() ? " and " : ", ") + name;
    outcomes += fmt::format("{}{:.4g} with {}", i == 0 ? "" : ", ",
                            plan.predicted[i].middle[telling], name);
  }
  return fmt::format("To decide between {}: {} Expected PV {} after the start: {}.", names,
                     test_sentence(plan), time_text(plan.time_s[telling]), outcomes);
}

std::string next_class_sentence(const gap::NextTest& test) {
  if (!test.next_class) return {};
  return fmt::format("With PV moved by up to {:.0f} % of its span, the probability is {:.2f}.",
                     100.0 * test.next_class->class_share, test.next_class->probability_right);
}

std::string test_yaml(const gap::NextTest& test, const std::string& model) {
  const TestPlan& plan = test.plan;
  const bool manual = estimator::in_manual(plan.move.kind);
  std::string names;
  for (const gap::Probability& h : test.explanations) {
    std::string one;
    for (const std::string& effect : h.effects) one += (one.empty() ? "" : ", ") + effect;
    names += (names.empty() ? "[" : ", [") + one + "]";
  }
  return fmt::format(
      "# Proposed by loopwarden gap. {}\n"
      "model: {}\n"
      "tells_apart: [{}]\n"
      "move: {}\n"
      "from: {:.6g}       # {}\n"
      "size: {:.6g}       # {}\n"
      "hold: {:.6g}       # s, each step or way\n"
      "duration: {:.6g}   # s\n"
      "expected: {{probability_right: {:.3f}, probability_wrong: {:.3f}, pv_swing: {:.4g}, "
      "output_swing: {:.4g}}}\n",
      test_sentence(test.plan), nlohmann::json(model).dump(), names,
      estimator::to_text(plan.move.kind), plan.moved.back(), manual ? "CO units" : "PV units",
      plan.move.size, manual ? "CO units" : "PV units", plan.move.hold_s, plan.duration_s,
      plan.probability_right, plan.probability_wrong, plan.pv_swing, plan.output_swing);
}

}  // namespace loopwarden::workbench
