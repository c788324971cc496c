// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/training_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {
namespace {

constexpr double kWidth = 460.0;
constexpr double kHeight = 240.0;
constexpr double kLeft = 52.0;
constexpr double kRight = 12.0;
constexpr double kTop = 26.0;
constexpr double kBottom = 30.0;
constexpr double kLeastError = 1e-12;

const char* const kHead =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Training</title><style>"
    "body{font:14px sans-serif;margin:1.5em;color:#222;background:#fff}"
    "svg{margin:4px}text{font:11px sans-serif;fill:#444}.grid{stroke:#ddd}"
    "polyline{fill:none;stroke-width:1.6}.training{stroke:#0b6fa4}.validation{stroke:#2a8f3c}"
    ".test{stroke:#b5392f}.best{stroke:#777;stroke-dasharray:4 3}"
    "@media(prefers-color-scheme:dark){body{background:#16181b;color:#ddd}text{fill:#bbb}"
    ".grid{stroke:#333}}</style>\n";

struct Curve {
  const char* kind;
  std::vector<double> values;
};

// Errors of one network over the epochs; `best` beyond them is not drawn.
std::string picture(const std::string& title, const std::vector<Curve>& curves, std::size_t best) {
  std::vector<std::vector<double>> logs;
  std::size_t length = 2;
  for (const Curve& curve : curves) {
    std::vector<double> log;
    for (const double value : curve.values) log.push_back(std::log10(std::max(value, kLeastError)));
    length = std::max(length, log.size());
    logs.push_back(std::move(log));
  }
  const std::vector<std::span<const double>> views(logs.begin(), logs.end());
  const PlotRange range = range_of(views, 0.05);
  const auto x = [&](double epoch) {
    return kLeft + epoch / static_cast<double>(length - 1) * (kWidth - kLeft - kRight);
  };
  const auto y = [&](double log) {
    return kTop + (range.high - log) / range.span() * (kHeight - kTop - kBottom);
  };
  std::string svg = fmt::format(
      "<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" role=\"img\"><text x=\"{2}\" "
      "y=\"14\">{3}</text>\n",
      kWidth, kHeight, kLeft, escaped(title));
  for (const Tick& tick : ticks(range, 5)) {
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.1g}</text>\n",
        kLeft, kWidth - kRight, y(tick.value), y(tick.value), kLeft - 4.0, y(tick.value) + 4.0,
        std::pow(10.0, tick.value));
  }
  for (const Tick& tick : ticks({0.0, static_cast<double>(length - 1)}, 6)) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                       x(tick.value), kHeight - kBottom + 16.0, tick.text);
  }
  for (std::size_t i = 0; i < curves.size(); ++i) {
    std::string points;
    for (std::size_t k = 0; k < logs[i].size(); ++k) {
      points += fmt::format("{:.1f},{:.1f} ", x(static_cast<double>(k)), y(logs[i][k]));
    }
    svg += fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", curves[i].kind, points);
  }
  if (best < length) {
    const double at = x(static_cast<double>(best));
    svg += fmt::format(
        "<line class=\"best\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\"/>", at,
        kTop, kHeight - kBottom);
  }
  return svg + "</svg>\n";
}

}  // namespace

std::string training_page(const TrainingResult& result) {
  std::string page = kHead;
  page += fmt::format("<h1>Training of {}</h1>\n<p>{}</p>\n", escaped(result.folder.plant),
                      escaped(result.folder.training.source));
  page +=
      "<p>Errors over epochs: <span style=\"color:#0b6fa4\">training</span>, "
      "<span style=\"color:#2a8f3c\">validation</span>, <span style=\"color:#b5392f\">test</span>; "
      "the dashed line is the best epoch, whose weights are kept.</p>\n";
  if (!result.team_epochs.empty()) {
    page += "<h2>Explaining form: cross-entropy, nats</h2>\n";
    std::size_t restarts = 0;
    for (const specialist::TeamEpoch& e : result.team_epochs) {
      restarts = std::max(restarts, e.restart + 1);
    }
    for (std::size_t r = 0; r < restarts; ++r) {
      std::vector<Curve> curves{{"training", {}}, {"validation", {}}};
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
    std::vector<Curve> curves{{"training", {}}, {"validation", {}}, {"test", {}}};
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
  return page;
}

}  // namespace loopwarden::workbench
