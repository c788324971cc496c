// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/next_test_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "model/numeric/statistics.hpp"
#include "workbench/text/posterior_bars.hpp"

namespace loopwarden::workbench {
namespace {

using estimator::MoveKind;
using estimator::TestPlan;

std::string time_text(double seconds) {
  return seconds < 120.0 ? fmt::format("{:.0f} s", seconds)
                         : fmt::format("{:.0f} min", std::ceil(seconds / 60.0));
}

constexpr double kEndsAt = 2.0;        // expected deviations, at which a test ends
constexpr std::size_t kBandRows = 60;  // rows of a band

// For a file that people read.
double five_digits(double value) { return std::stod(fmt::format("{:.5g}", value)); }

}  // namespace

std::vector<std::string> names_of(const gap::NextTest& test) {
  std::vector<std::string> names;
  for (const gap::Probability& one : test.explanations) names.push_back(title_of(one.effects));
  return names;
}

std::string joined(const std::vector<std::string>& names, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? last : ", ") + names[i];
  return text;
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

std::vector<double> means_of(const std::vector<double>& values, std::size_t count) {
  count = std::min(count, values.size());
  std::vector<double> means;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = i * values.size() / count;
    const std::size_t to = (i + 1) * values.size() / count;
    means.push_back(numeric::mean(std::span(values).subspan(from, to - from)));
  }
  return means;
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
  return pv_share < 0.011 ? "technician" : pv_share < 0.031 ? "operator" : "test day";
}

std::string proposed_test_text(const TestPlan& plan, const std::vector<std::string>& names) {
  // The moment at which the explanations differ most, apart from noise.
  constexpr std::size_t kMoments = 40;
  std::vector<std::vector<double>> pv;
  for (const estimator::Predicted& one : plan.predicted) {
    pv.push_back(means_of(one.middle, kMoments));
    for (double& value : pv.back()) value -= one.middle.front();
  }
  const std::vector<double> times = means_of(plan.time_s, kMoments);
  std::size_t telling = 0;
  double most = -1.0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    double low = pv.front()[k];
    double high = low;
    for (const std::vector<double>& one : pv) {
      low = std::min(low, one[k]);
      high = std::max(high, one[k]);
    }
    if (high - low > most) {
      most = high - low;
      telling = k;
    }
  }
  std::string outcomes;
  for (std::size_t i = 0; i < names.size(); ++i)
    outcomes += fmt::format("{}{:+.2g} with {}", i == 0 ? "" : ", ", pv[i][telling], names[i]);
  return fmt::format(
      "To decide between {}: {} Expected change of PV {} after the start: {} (PV units). Of 100 "
      "simulated tests, {:.0f} decide rightly and {:.0f} wrongly. The test takes {}, and moves PV "
      "by at most {:.2g} PV units and CO by {:.2g} CO units. Permission: {} (the move adds up to "
      "{:.2g} % of the span of PV).",
      joined(names, " and "), test_sentence(plan), time_text(times[telling]), outcomes,
      100.0 * plan.probability_right, 100.0 * plan.probability_wrong, time_text(plan.duration_s),
      plan.pv_swing, plan.output_swing, allowed_by(plan.class_share), 100.0 * plan.class_share);
}

std::string next_class_sentence(const gap::NextTest& test) {
  if (!test.next_class) return {};
  return fmt::format("With PV moved by up to {:.0f} % of its span, the probability is {:.2f}.",
                     100.0 * test.next_class->class_share, test.next_class->probability_right);
}

TestPlanFile plan_file(const gap::Result& result) {
  const gap::NextTest& test = result.next_test.value();
  const TestPlan& plan = test.plan;
  TestPlanFile file;
  file.move = plan.move;
  file.move.hold_s = five_digits(plan.move.hold_s);
  file.from = plan.moved.back();
  file.probability_right = five_digits(plan.probability_right);
  file.probability_wrong = five_digits(plan.probability_wrong);
  file.pv_swing = five_digits(plan.pv_swing);
  file.output_swing = five_digits(plan.output_swing);
  const auto around = [](double middle, double swing, double low, double high) {
    return std::array{std::max(five_digits(middle - kEndsAt * swing), low),
                      std::min(five_digits(middle + kEndsAt * swing), high)};
  };
  const plant::TransmitterParameters& pv = result.model.transmitter;
  const control::PidSettings& pid = result.model.controller.pid;
  file.pv_limits = around(result.series.sp.back(), plan.pv_swing, pv.low, pv.high);
  file.co_limits =
      around(result.series.co.back(), plan.output_swing, pid.output_low, pid.output_high);
  const std::size_t step = plan.time_s.size() / kBandRows + 1;
  for (std::size_t i = 0; i < test.explanations.size(); ++i) {
    PlannedExplanation one{.effects = test.explanations[i].effects,
                           .probability = test.explanations[i].probability,
                           .pv = {}};
    const estimator::Predicted& band = plan.predicted[i];
    for (std::size_t k = 0; k < plan.time_s.size(); k += step) {
      one.pv.push_back(
          {five_digits(plan.time_s[k]), five_digits(band.low[k]), five_digits(band.high[k])});
    }
    file.explanations.push_back(std::move(one));
  }
  return file;
}

}  // namespace loopwarden::workbench
