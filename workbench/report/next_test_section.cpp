// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/next_test_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "workbench/report/chart.hpp"
#include "workbench/text/next_test_text.hpp"
#include "workbench/text/posterior_bars.hpp"

namespace loopwarden::workbench {
namespace {

using estimator::TestPlan;

constexpr std::size_t kDrawnColumns =
    150;                               // of a drawing: the noise of single samples hides the bands
constexpr double kDrawnWidth = 480.0;  // legible on a phone
constexpr std::array<const char*, 3> kExplanationColours{palette::kBlue, palette::kVermilion,
                                                         palette::kGreen};

std::vector<double> columns_of(const std::vector<double>& values) {
  return means_of(values, kDrawnColumns);
}

Chart move_chart(const TestPlan& plan) {
  const bool manual = estimator::in_manual(plan.move.kind);
  Chart chart{.title = manual ? "The move of the output" : "The move of SP",
              .x_label = "s",
              .y_label = manual ? "CO units" : "PV units",
              .width = kDrawnWidth};
  ChartLine line{manual ? "CO" : "SP", palette::kInk, plan.time_s, plan.moved};
  // From the value before.
  line.x.insert(line.x.begin(), 0.0);
  line.y.insert(line.y.begin(), plan.moved.back());
  chart.lines.push_back(std::move(line));
  return chart;
}

Chart predicted_chart(const gap::NextTest& test) {
  const TestPlan& plan = test.plan;
  Chart chart{.title = "Expected PV; shaded: 90 % of the tests",
              .x_label = "s",
              .y_label = "PV units",
              .width = kDrawnWidth,
              .x_range = PlotRange{0.0, plan.duration_s}};
  const std::vector<double> time = columns_of(plan.time_s);
  for (std::size_t i = 0; i < test.explanations.size(); ++i) {
    const estimator::Predicted& band = plan.predicted[i];
    const std::string colour = kExplanationColours[i % kExplanationColours.size()];
    chart.areas.push_back({colour, time, columns_of(band.low), columns_of(band.high)});
    chart.lines.push_back(
        {title_of(test.explanations[i].effects), colour, time, columns_of(band.middle)});
  }
  return chart;
}

}  // namespace

std::string next_test_section(const gap::NextTest& test) {
  return fmt::format(
      "<p>{}</p><p>{}</p>\n<div class=\"pair\"><figure class=\"drawn\">{}</figure>"
      "<figure class=\"drawn\">{}</figure></div>\n",
      escaped(proposed_test_text(test.plan, names_of(test))), escaped(next_class_sentence(test)),
      chart_svg(move_chart(test.plan)), chart_svg(predicted_chart(test)));
}

std::string test_slip_html(const std::string& tag, const gap::NextTest& test,
                           const std::string& until) {
  const TestPlan& plan = test.plan;
  const std::string from =
      fmt::format("{:.4g} {}", plan.moved.back(),
                  estimator::in_manual(plan.move.kind) ? "CO units" : "PV units");
  return html_page(
      "Test slip " + tag,
      fmt::format(
          "<p>For the operator of <b>{0}</b>. Loopwarden only reads this loop. "
          "It recognises the move in the data. This slip is valid until {6}.</p>\n"
          "<ol><li>Wait until the loop is steady near {1}, without an active alarm. PV can deviate "
          "by {2:.3g} PV units: compare this with its alarm limits.</li>"
          "<li>{3}</li>"
          "<li>End the test and return to {1} if PV leaves its limits.</li>"
          "<li>{4}</li></ol>\n{5}"
          "<p>Done on ____________ at ________ by ________________</p>\n",
          escaped(tag), from, plan.pv_swing, escaped(test_sentence(plan)),
          estimator::in_manual(plan.move.kind)
              ? "Return the loop to automatic after the last step."
              : "Leave SP at its value of before for as long again.",
          next_test_section(test), escaped(until)));
}

}  // namespace loopwarden::workbench
