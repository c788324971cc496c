// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/next_test_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

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

std::string competing_names(const gap::NextTest& test) {
  std::string names;
  for (std::size_t i = 0; i < test.explanations.size(); ++i) {
    const bool last = i + 1 == test.explanations.size();
    names += (i == 0 ? "" : last ? " or " : ", ") + title_of(test.explanations[i].effects);
  }
  return names;
}

std::string test_sentence(const gap::NextTest& test) {
  const TestPlan& plan = test.plan;
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

std::string expected_sentence(const gap::NextTest& test) {
  return fmt::format(
      "It decides rightly with probability {:.2f} and wrongly with {:.2f}, takes {}, and moves PV "
      "by "
      "at most {:.3g} PV units and CO by {:.3g} CO units.",
      test.plan.probability_right, test.plan.probability_wrong, time_text(test.plan.duration_s),
      test.plan.pv_swing, test.plan.output_swing);
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
  file.from = plan.moved.back();
  file.probability_right = plan.probability_right;
  file.probability_wrong = plan.probability_wrong;
  file.pv_swing = plan.pv_swing;
  file.output_swing = plan.output_swing;
  const auto around = [](double middle, double swing, double low, double high) {
    return std::array{std::max(middle - kEndsAt * swing, low),
                      std::min(middle + kEndsAt * swing, high)};
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
      one.pv.push_back({plan.time_s[k], five_digits(band.low[k]), five_digits(band.high[k])});
    }
    file.explanations.push_back(std::move(one));
  }
  return file;
}

}  // namespace loopwarden::workbench
