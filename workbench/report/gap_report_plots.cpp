// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/gap_report_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {
namespace {

using Column = std::vector<double>;

// Points for 2000 stretches of time show no step at twice the width of the page, and keep a record
// of any length below a megabyte.
constexpr std::size_t kMostStretches = 2000;
constexpr std::size_t kMostPhasePoints = 3000;
constexpr std::size_t kTableRows = 25;
// A controller that holds less of the gap than this is not worth two more curves.
constexpr double kControllerShare = 0.1;

struct Curve {
  const char* name;
  const char* style;  // of gap_report_page.cpp
  const Column* values;
};

struct Shade {
  double from_s;
  double to_s;
  double share;
  std::string what;
};

struct TimePlot {
  const char* id;
  const char* title;
  std::string text;
  const char* unit;  // at the axis
  double height;     // of the drawing, in the units of a page 1000 wide
  std::vector<Curve> curves;
  bool zero_line = false;
  double floor = 0.0;  // lines at plus and minus this
  std::vector<Shade> shades{};
};

// Where the pictures stand on their time axis.
struct TimeAxis {
  std::size_t samples = 0;
  double first_s = 0.0;
  double period_s = 1.0;

  explicit TimeAxis(const gap::Series& series) : samples(series.pv.size()) {
    const Column& t = series.time_s;
    if (samples < 2 || t.size() != samples) {
      samples = std::min(samples, t.size());
      return;
    }
    first_s = t.front();
    const double span = t.back() - t.front();
    period_s = span / static_cast<double>(samples - 1);
    if (!std::isfinite(period_s) || period_s <= 0.0) samples = 0;
  }
  bool drawable() const { return samples >= 2; }
  double last() const { return static_cast<double>(samples - 1); }
  double sample(double time_s) const { return (time_s - first_s) / period_s; }
  double time_s(double sample) const { return first_s + sample * period_s; }
};

bool has_values(const Column& column, const TimeAxis& axis) {
  return column.size() == axis.samples &&
         std::any_of(column.begin(), column.end(), [](double v) { return std::isfinite(v); });
}

Column difference(const Column& a, const Column& b) {
  Column result;
  if (a.size() != b.size()) return result;
  result.reserve(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) result.push_back(a[k] - b[k]);
  return result;
}

PlotRange range_of_curves(const std::vector<Curve>& curves, double margin) {
  std::vector<std::span<const double>> columns;
  for (const Curve& curve : curves) columns.emplace_back(*curve.values);
  return range_of(columns, margin);
}

// Axes of an outer drawing around an inner one.
struct Frame {
  double left;
  double top;
  double width;
  double height;
};

std::string axes(const Frame& f, const PlotRange& across, int across_ticks, const PlotRange& up,
                 int up_ticks) {
  std::string text = "<g class=\"grid across\">";
  for (const Tick& tick : ticks(across, across_ticks)) {
    const double x = f.left + (tick.value - across.low) / across.span() * f.width;
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>"
        "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>",
        x, f.top, f.top + f.height, f.top + f.height + 16.0, tick.text);
  }
  text += "</g><g class=\"grid up\">";
  for (const Tick& tick : ticks(up, up_ticks)) {
    const double y = f.top + (up.high - tick.value) / up.span() * f.height;
    text += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>",
        f.left, f.left + f.width, y, f.left - 6.0, y + 4.0, tick.text);
  }
  return text + "</g>";
}

std::string legend(const std::vector<Curve>& curves) {
  std::string text = "<ul class=\"legend\">";
  for (const Curve& curve : curves) {
    text += fmt::format(
        "<li><button type=\"button\" data-curve=\"{0}\" aria-pressed=\"true\">"
        "<svg aria-hidden=\"true\"><line class=\"{0}\" x1=\"0\" x2=\"28\" y1=\"6\" y2=\"6\"/></svg>"
        "{1} <output></output></button></li>",
        curve.style, escaped(curve.name));
  }
  return text + "</ul>";
}

std::string value_table(const TimePlot& plot, const TimeAxis& axis) {
  std::string text =
      "<details><summary>Values as a table</summary><div class=\"wide\"><table><thead><tr>"
      "<th class=\"n\">time, s</th>";
  for (const Curve& curve : plot.curves) {
    text += fmt::format("<th class=\"n\">{}</th>", escaped(curve.name));
  }
  text += "</tr></thead><tbody>";
  const std::size_t rows = std::min(axis.samples, kTableRows);
  for (std::size_t i = 0; i < rows; ++i) {
    const std::size_t k = rows > 1 ? i * (axis.samples - 1) / (rows - 1) : 0;
    text += fmt::format("<tr><td class=\"n\">{}</td>",
                        plain_number(axis.time_s(static_cast<double>(k))));
    for (const Curve& curve : plot.curves) {
      text += fmt::format("<td class=\"n\">{}</td>", plain_number((*curve.values)[k]));
    }
    text += "</tr>";
  }
  return text + "</tbody></table></div></details>";
}

// A stretch of samples as a rectangle over the full height, wherever the picture is zoomed to.
std::string stretch(const TimeAxis& axis, double from_s, double to_s, const std::string& attributes,
                    const std::string& tooltip) {
  const double from = std::clamp(axis.sample(from_s), 0.0, axis.last());
  const double to = std::clamp(axis.sample(to_s), from, axis.last());
  return fmt::format(
      "<rect {} x=\"{:.1f}\" y=\"-100000\" width=\"{:.1f}\" height=\"200000\">{}</rect>",
      attributes, from, to - from,
      tooltip.empty() ? std::string() : "<title>" + escaped(tooltip) + "</title>");
}

std::string time_plot(const TimePlot& plot, const TimeAxis& axis, double holdout_from_s) {
  const Frame frame{.left = 62.0, .top = 8.0, .width = 926.0, .height = plot.height - 34.0};
  const PlotRange range = range_of_curves(plot.curves, 0.05);
  const PlotRange across{axis.first_s, axis.time_s(axis.last())};

  std::string names;
  for (const Curve& curve : plot.curves) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", escaped(curve.name));
  }
  std::string text = fmt::format(
      "<figure id=\"{0}\"><figcaption><b>{1}</b> {2}</figcaption>{3}"
      "<svg class=\"plot time\" viewBox=\"0 0 1000 {4}\" role=\"img\" "
      "aria-labelledby=\"{0}-t {0}-d\" data-low=\"{5:.9g}\" data-high=\"{6:.9g}\">"
      "<title id=\"{0}-t\">{1} over time</title>"
      "<desc id=\"{0}-d\">Curves: {7}. From {8} to {9} s, {10} from {11} to {12}.</desc>",
      plot.id, plot.title, plot.text, legend(plot.curves), plot.height, range.low, range.high,
      names, plain_number(across.low), plain_number(across.high), plot.unit,
      plain_number(range.low), plain_number(range.high));
  text += axes(frame, across, 10, range, static_cast<int>(frame.height / 38.0));
  text += fmt::format(
      "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {:g} {:g}\" "
      "preserveAspectRatio=\"none\">",
      frame.left, frame.top, frame.width, frame.height, axis.last(), kPlotHeight);

  const double held_from = axis.sample(holdout_from_s);
  const bool has_holdout = held_from > 0.0 && held_from < axis.last();
  if (has_holdout) {
    text += stretch(axis, holdout_from_s, across.high, "class=\"held\"", "");
  }
  for (const Shade& shade : plot.shades) {
    text += stretch(axis, shade.from_s, shade.to_s,
                    fmt::format("class=\"located\" fill-opacity=\"{:.2f}\"",
                                0.1 + 0.35 * std::clamp(shade.share, 0.0, 1.0)),
                    shade.what);
  }
  const auto level = [&](const char* style, double value) {
    text += fmt::format("<line class=\"{0}\" x1=\"0\" x2=\"{1:g}\" y1=\"{2:.0f}\" y2=\"{2:.0f}\"/>",
                        style, axis.last(), range.down(value));
  };
  if (plot.zero_line) level("zero", 0.0);
  if (plot.floor > 0.0) {
    level("floor", plot.floor);
    level("floor", -plot.floor);
  }
  for (const Curve& curve : plot.curves) {
    text += fmt::format("<path class=\"{0}\" data-curve=\"{0}\" d=\"{1}\"/>", curve.style,
                        path_data(decimated(*curve.values, range, kMostStretches)));
  }
  text += fmt::format(
      "</svg><rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>"
      "<text class=\"axis\" x=\"{}\" y=\"{}\">{}</text>",
      frame.left, frame.top, frame.width, frame.height, frame.left + 6.0, frame.top + 15.0,
      plot.unit);
  if (has_holdout) {
    text += fmt::format(
        "<text class=\"mark\" data-k=\"{:.1f}\" x=\"{:.1f}\" y=\"{}\">held back</text>", held_from,
        frame.left + held_from / axis.last() * frame.width + 5.0, frame.top + frame.height - 7.0);
  }
  return text + "</svg>" + value_table(plot, axis) + "</figure>";
}

// Moments, not the whole record: shading everything shows nothing.
std::vector<Shade> shades_of(const gap::Result& result, const TimeAxis& axis) {
  const double most_s = 0.9 * axis.last() * axis.period_s;
  std::vector<Shade> shades;
  for (const gap::Located& located : result.located) {
    const double length_s = located.to_s - located.from_s;
    if (located.by == gap::LocatedBy::block || !(length_s > 0.0) || length_s > most_s) continue;
    if (!(located.share_of_gap > 0.0)) continue;
    shades.push_back({located.from_s, located.to_s, located.share_of_gap,
                      fmt::format("{}: {:.0f} % of the gap by {}", located.what,
                                  100.0 * located.share_of_gap, gap::to_text(located.by))});
  }
  return shades;
}

std::string tools(const gap::Result& result, const TimeAxis& axis) {
  std::string text =
      "<div class=\"tools\" role=\"toolbar\" aria-label=\"Span of time\">"
      "<button type=\"button\" data-act=\"closer\" aria-label=\"zoom in\">+</button>"
      "<button type=\"button\" data-act=\"wider\" aria-label=\"zoom out\">&minus;</button>"
      "<button type=\"button\" data-act=\"left\" aria-label=\"earlier\">&larr;</button>"
      "<button type=\"button\" data-act=\"right\" aria-label=\"later\">&rarr;</button>"
      "<button type=\"button\" data-act=\"all\">all</button>";
  const double end_s = axis.time_s(axis.last());
  if (result.holdout_from_s > axis.first_s && result.holdout_from_s < end_s) {
    text += fmt::format(
        "<button type=\"button\" data-from=\"{}\" data-to=\"{}\">held-back part</button>",
        result.holdout_from_s, end_s);
  }
  return text +
         "<span class=\"note\">Drag to select a span, then to move it. Ctrl + wheel zooms; after a "
         "click the wheel alone and + &minus; 0 &larr; &rarr; do.</span>"
         "<output id=\"at\"></output><output id=\"span\"></output></div>";
}

// The same curve twice would hide that nothing was changed.
bool differ(const Column& a, const Column& b) { return !a.empty() && !b.empty() && a != b; }

std::string phase_plot(const char* id, const char* title, const std::string& caption,
                       const char* up_name, const char* across_name, const Column& across_values,
                       const TimeAxis& axis, const std::vector<Curve>& curves) {
  const std::span<const double> across_column(across_values);
  const PlotRange across = range_of(std::span(&across_column, 1), 0.04);
  const PlotRange up = range_of_curves(curves, 0.04);
  const Frame frame{.left = 56.0, .top = 8.0, .width = 432.0, .height = 340.0};
  const std::size_t stride = std::max<std::size_t>(1, axis.samples / kMostPhasePoints);

  std::string text =
      fmt::format("<figure id=\"{0}\"><figcaption><b>{1}</b> {2}</figcaption><ul class=\"legend\">",
                  id, title, caption);
  for (const Curve& curve : curves) {
    text += fmt::format(
        "<li><span class=\"key\"><svg aria-hidden=\"true\"><line class=\"{0}\" x1=\"0\" x2=\"28\" "
        "y1=\"6\" y2=\"6\"/></svg>{1}</span></li>",
        curve.style, escaped(curve.name));
  }
  text += fmt::format(
      "</ul><svg class=\"plot phase\" viewBox=\"0 0 500 390\" role=\"img\" "
      "aria-labelledby=\"{0}-t {0}-d\" data-lowx=\"{1:.9g}\" data-highx=\"{2:.9g}\" "
      "data-low=\"{3:.9g}\" data-high=\"{4:.9g}\"><title id=\"{0}-t\">{5}</title>"
      "<desc id=\"{0}-d\">{6} against {7}. What is plotted over time has its values in the tables "
      "there.</desc>",
      id, across.low, across.high, up.low, up.high, title, up_name, across_name);
  text += axes(frame, across, 6, up, 8);
  text += fmt::format(
      "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {:g} {:g}\" "
      "preserveAspectRatio=\"none\">",
      frame.left, frame.top, frame.width, frame.height, kPlotHeight, kPlotHeight);
  for (const Curve& curve : curves) {
    std::vector<PlotPoint> points;
    std::string firsts;
    bool gap = true;
    for (std::size_t k = 0; k < axis.samples; k += stride) {
      const double x = across_values[k];
      const double y = (*curve.values)[k];
      if (!std::isfinite(x) || !std::isfinite(y)) {
        gap = true;
        continue;
      }
      if (gap) firsts += fmt::format("{}{}", firsts.empty() ? "" : " ", k);
      points.push_back({std::llround((x - across.low) / across.span() * kPlotHeight),
                        std::llround(up.down(y)), gap});
      gap = false;
    }
    text += fmt::format("<path class=\"{}\" data-first=\"{}\" data-stride=\"{}\" d=\"{}\"/>",
                        curve.style, firsts, stride, path_data(points));
  }
  return text +
         fmt::format(
             "</svg><rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>"
             "<text class=\"axis\" x=\"{}\" y=\"{}\">{}</text>"
             "<text class=\"axis\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text></svg></figure>",
             frame.left, frame.top, frame.width, frame.height, frame.left + 6.0, frame.top + 15.0,
             up_name, frame.left + frame.width - 6.0, frame.top + frame.height - 8.0, across_name);
}

}  // namespace

bool has_controller_gap(const gap::Result& result) {
  for (const gap::FoundEffect& effect : result.effects) {
    if (effect.block == plant::Block::controller) return true;
  }
  for (const gap::Located& located : result.located) {
    if (located.by == gap::LocatedBy::block && located.block == plant::Block::controller &&
        located.share_of_gap >= kControllerShare) {
      return true;
    }
  }
  return false;
}

std::string gap_time_plots_html(const gap::Result& result) {
  const gap::Series& s = result.series;
  const TimeAxis axis(s);
  if (!axis.drawable() || !has_values(s.pv, axis)) return "";
  const char* before_name =
      differ(s.pv_before, s.pv_after) ? "model as given" : "model as given, unchanged";
  const auto add = [&](std::vector<Curve>& curves, const char* name, const char* style,
                       const Column& values) {
    if (has_values(values, axis)) curves.push_back({name, style, &values});
  };
  const bool changed = differ(s.pv_before, s.pv_after) || s.pv_before.empty();

  std::vector<TimePlot> plots;
  TimePlot pv{.id = "trend",
              .title = "PV",
              .text = result.closed_loop
                          ? "measured and in a free closed-loop run of the model, driven by SP."
                          : "measured and in a free run of the model, driven by the measured CO.",
              .unit = "PV",
              .height = 300.0,
              .curves = {}};
  add(pv.curves, "SP", "sp", s.sp);
  add(pv.curves, before_name, "before", s.pv_before);
  if (changed) add(pv.curves, "corrected model", "after", s.pv_after);
  add(pv.curves, "measured", "measured", s.pv);
  plots.push_back(std::move(pv));

  const Column residual_before = difference(s.pv, s.pv_before);
  const Column residual_after = difference(s.pv, s.pv_after);
  TimePlot residual{
      .id = "residual",
      .title = "Residual",
      .text =
          "measured PV minus model. Shaded: where the gap was located, darker for a larger "
          "share. Dotted: the noise floor.",
      .unit = "PV",
      .height = 230.0,
      .curves = {},
      .zero_line = true,
      .floor = result.noise_floor_rmse,
      .shades = shades_of(result, axis)};
  add(residual.curves, before_name, "before", residual_before);
  if (changed) add(residual.curves, "corrected model", "after", residual_after);
  if (!residual.curves.empty()) plots.push_back(std::move(residual));

  TimePlot co{
      .id = "output", .title = "CO", .text = "", .unit = "CO", .height = 200.0, .curves = {}};
  if (has_controller_gap(result)) {
    co.text = "measured and as the model's controller gives it from the measured SP and PV.";
    const bool controller_changed = differ(s.co_before, s.co_after) || s.co_before.empty();
    add(co.curves, "controller as given", "before", s.co_before);
    if (controller_changed) add(co.curves, "corrected controller", "after", s.co_after);
  } else {
    co.text = "as measured.";
  }
  add(co.curves, "measured", "measured", s.co);
  if (!co.curves.empty()) plots.push_back(std::move(co));

  std::string text =
      fmt::format("<div id=\"plots\" data-n=\"{}\" data-t0=\"{:.9g}\" data-period=\"{:.12g}\">{}",
                  axis.samples, axis.first_s, axis.period_s, tools(result, axis));
  for (const TimePlot& plot : plots) text += time_plot(plot, axis, result.holdout_from_s);
  return text + "<p class=\"note\">Time in s.</p></div>";
}

std::string gap_phase_plots_html(const gap::Result& result) {
  const gap::Series& s = result.series;
  const TimeAxis axis(s);
  if (!axis.drawable() || !has_values(s.co, axis)) return "";
  std::vector<Curve> curves;
  const auto add = [&](const char* name, const char* style, const Column& values) {
    if (has_values(values, axis)) curves.push_back({name, style, &values});
  };
  add("measured", "measured", s.pv);
  add("model as given", "before", s.pv_before);
  if (differ(s.pv_before, s.pv_after) || s.pv_before.empty()) {
    add("corrected model", "after", s.pv_after);
  }
  std::string text = "<div class=\"pair\">";
  if (!curves.empty()) {
    text += phase_plot("phase", "PV over CO", "of the span of time that is shown above.", "PV",
                       "CO", s.co, axis, curves);
  }
  // The read-back parts the valve from what comes after it.
  if (has_values(s.stem, axis)) {
    text += phase_plot("stem", "Stem over CO", "the valve up to its stem, as measured.", "stem",
                       "CO", s.co, axis, {{"measured", "measured", &s.stem}});
    if (has_values(s.pv, axis)) {
      text += phase_plot("pv-stem", "PV over stem", "the plug and the process, as measured.", "PV",
                         "stem", s.stem, axis, {{"measured", "measured", &s.pv}});
    }
  }
  return text + "</div>";
}

}  // namespace loopwarden::workbench
