// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/training_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "workbench/report/chart.hpp"

namespace loopwarden::workbench {
namespace {

constexpr double kLeastError = 1e-12;

struct ErrorCurve {
  const char* name;
  std::vector<double> values;  // by epoch
};

// Draws the errors of one network over the epochs. `best` is not drawn if it is beyond them.
std::string picture(const std::string& title, const std::vector<ErrorCurve>& curves,
                    std::size_t best) {
  Chart chart{.title = title, .x_label = "epoch", .y_label = "", .width = 460.0, .height = 240.0};
  chart.logarithmic_y = true;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  std::size_t length = 0;
  for (const ErrorCurve& curve : curves) {
    ChartLine line{.name = curve.name, .colour = chart_colour(chart.lines.size())};
    for (const double value : curve.values) {
      line.y.push_back(std::log10(std::max(value, kLeastError)));
      low = std::min(low, line.y.back());
      high = std::max(high, line.y.back());
    }
    line.x = time_axis(line.y.size(), 1.0);
    length = std::max(length, line.y.size());
    chart.lines.push_back(std::move(line));
  }
  if (best < length) {
    const auto at = static_cast<double>(best);
    chart.lines.push_back(
        {.name = "", .colour = palette::kGrey, .x = {at, at}, .y = {low, high}, .dashed = true});
  }
  return chart_svg(chart);
}

}  // namespace

std::string training_page(const TrainingResult& result) {
  std::string page = fmt::format(
      "<p>{}</p>\n<p>Errors over epochs; the dashed line is the best epoch, whose weights are "
      "kept.</p>\n",
      escaped(result.folder.training.source));
  if (!result.team_epochs.empty()) {
    page += "<h2>Explaining form: cross-entropy, nats</h2>\n";
    std::size_t restarts = 0;
    for (const specialist::TeamEpoch& e : result.team_epochs) {
      restarts = std::max(restarts, e.restart + 1);
    }
    for (std::size_t r = 0; r < restarts; ++r) {
      std::vector<ErrorCurve> curves{{"training", {}}, {"validation", {}}};
      for (const specialist::TeamEpoch& e : result.team_epochs) {
        if (e.restart != r) continue;
        curves[0].values.push_back(e.training);
        curves[1].values.push_back(e.validation);
      }
      const auto& v = curves[1].values;
      const auto best = static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
      page += picture(
          fmt::format("start {}: best {:.4f} at epoch {}", r + 1, v.empty() ? 0.0 : v[best], best),
          curves, best);
    }
  }
  if (!result.sizes.empty()) page += "<h2>Signature form: mean square error, (PV units)^2</h2>\n";
  for (const TrainedSize& s : result.sizes) {
    std::vector<ErrorCurve> curves{{"training", {}}, {"validation", {}}, {"test", {}}};
    const double unit = s.half_span * s.half_span;
    for (const specialist::Epoch& e : s.epochs) {
      curves[0].values.push_back(e.training * unit);
      curves[1].values.push_back(e.validation * unit);
      curves[2].values.push_back(e.test * unit);
    }
    page += picture(fmt::format("{}{}: best validation {:.4g} at epoch {}, stopped by {}",
                                s.specialist, s.chosen ? " (chosen)" : "",
                                s.epochs[s.best].validation * unit, s.best, to_text(s.stop)),
                    curves, s.best);
  }
  return html_page("Training of " + result.folder.plant, page);
}

}  // namespace loopwarden::workbench
