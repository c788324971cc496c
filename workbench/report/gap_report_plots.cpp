// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/gap_report_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "workbench/report/chart.hpp"

namespace loopwarden::workbench {
namespace {

using Column = std::vector<double>;

// Number of stretches of time per curve. No step is visible at the width of the page, and the page
// stays below a megabyte for records of any length.
constexpr std::size_t kMostStretches = 1200;
constexpr std::size_t kMostPhasePoints = 2000;
constexpr double kStillWidth = 760.0;  // of a picture on paper
constexpr std::size_t kTableRows = 25;
// If the controller causes a smaller share of the gap than this, its two curves are left out.
constexpr double kControllerShare = 0.1;

struct Curve {
  const char* name;
  const char* style;  // a colour of palette_style
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
  double height;     // of the drawing
  std::vector<Curve> curves;
  bool zero_line = false;
  double floor = 0.0;  // draws lines at plus and minus this value
  std::vector<Shade> shades{};
};

// Position of the pictures on their time axis.
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

const char* colour_of(std::string_view style) {
  if (style == "measured") return palette::kMeasured;
  if (style == "before") return palette::kBefore;
  if (style == "after") return palette::kAfter;
  return palette::kSetPoint;
}
bool is_dashed(std::string_view style) { return style == "before" || style == "sp"; }

// Appends a number to JSON, or null if it is not finite.
void put(nlohmann::json& list, double value) {
  if (std::isfinite(value)) {
    list.push_back(std::stod(fmt::format("{:.6g}", value)));
  } else {
    list.push_back(nullptr);
  }
}

ChartLine line_of(const Curve& curve, std::vector<double> x) {
  return {.name = curve.name,
          .colour = colour_of(curve.style),
          .x = std::move(x),
          .y = *curve.values,
          .dashed = is_dashed(curve.style)};
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

// Returns a description of the plot for screen readers.
std::string described(const TimePlot& plot, const TimeAxis& axis, const PlotRange& range) {
  std::string names;
  for (const Curve& curve : plot.curves) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", curve.name);
  }
  return fmt::format("{} over time. Curves: {}. From {} to {} s, {} from {} to {}.", plot.title,
                     names, plain_number(axis.first_s), plain_number(axis.time_s(axis.last())),
                     plot.unit, plain_number(range.low), plain_number(range.high));
}

bool holds_back(const TimeAxis& axis, double holdout_from_s) {
  const double from = axis.sample(holdout_from_s);
  return from > 0.0 && from < axis.last();
}

// Returns the static picture, for paper and for browsers without scripts.
std::string still(const TimePlot& plot, const TimeAxis& axis, double holdout_from_s) {
  Chart chart{.title = plot.title,
              .x_label = "s",
              .y_label = plot.unit,
              .width = kStillWidth,
              .height = plot.height};
  std::vector<double> time;
  for (std::size_t k = 0; k < axis.samples; ++k) {
    time.push_back(axis.time_s(static_cast<double>(k)));
  }
  for (const Curve& curve : plot.curves) chart.lines.push_back(line_of(curve, time));
  if (holds_back(axis, holdout_from_s)) {
    chart.bands.push_back({.from = holdout_from_s,
                           .to = axis.time_s(axis.last()),
                           .colour = palette::kSoft,
                           .opacity = 0.1,
                           .meaning = "held out"});
  }
  for (const Shade& shade : plot.shades) {
    chart.bands.push_back({.from = shade.from_s,
                           .to = shade.to_s,
                           .colour = palette::kOrange,
                           .opacity = 0.1 + 0.35 * std::clamp(shade.share, 0.0, 1.0),
                           .meaning = shade.what});
  }
  if (plot.zero_line) chart.levels.push_back(0.0);
  if (plot.floor > 0.0) chart.levels.insert(chart.levels.end(), {plot.floor, -plot.floor});
  return "<div class=\"still\">" + chart_svg(chart) + "</div>";
}

std::string figure(const char* id, const char* title, const std::string& text,
                   const std::string& description, const std::string& picture,
                   const std::string& table) {
  return fmt::format(
      "<figure id=\"{}\"><figcaption><b>{}</b> {}</figcaption>"
      "<div class=\"chart\" role=\"img\" aria-label=\"{}\"></div>{}{}</figure>",
      id, title, text, escaped(description), picture, table);
}

PlotRange range_of_curves(const std::vector<Curve>& curves) {
  std::vector<std::span<const double>> columns;
  for (const Curve& curve : curves) columns.emplace_back(*curve.values);
  return range_of(columns, 0.0);
}

std::string time_plot(const TimePlot& plot, const TimeAxis& axis, double holdout_from_s) {
  return figure(plot.id, plot.title, plot.text, described(plot, axis, range_of_curves(plot.curves)),
                still(plot, axis, holdout_from_s), value_table(plot, axis));
}

// Returns the points of the curves by sample: the least and the greatest of every stretch, so that
// no peak is lost.
nlohmann::json time_data(const TimePlot& plot) {
  nlohmann::json curves = nlohmann::json::array();
  for (const Curve& curve : plot.curves) {
    nlohmann::json k = nlohmann::json::array();
    nlohmann::json y = nlohmann::json::array();
    const Column& values = *curve.values;
    std::int64_t last = -1;
    for (const PlotPoint& point : decimated(values, range_of_curves({curve}), kMostStretches)) {
      // One sample without a value marks the gap before this point.
      if (point.starts && last >= 0 && point.x > last + 1) {
        k.push_back(last + 1);
        y.push_back(nullptr);
      }
      k.push_back(point.x);
      put(y, values[static_cast<std::size_t>(point.x)]);
      last = point.x;
    }
    curves.push_back({{"name", curve.name}, {"style", curve.style}, {"k", k}, {"y", y}});
  }
  nlohmann::json shades = nlohmann::json::array();
  for (const Shade& shade : plot.shades) shades.push_back({shade.from_s, shade.to_s, shade.share});
  return {{"id", plot.id},         {"title", plot.title},    {"unit", plot.unit},
          {"height", plot.height}, {"zero", plot.zero_line}, {"floor", plot.floor},
          {"curves", curves},      {"shades", shades}};
}

// Shades short stretches only, because shading the whole record would not help the reader.
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
         "<button type=\"button\" data-act=\"png\" aria-label=\"save what is shown as a "
         "picture\">PNG</button>"
         "<button type=\"button\" data-act=\"csv\" aria-label=\"save what is shown as a "
         "table\">CSV</button>"
         "<span class=\"note\">Drag to zoom in, double-click to reset. Ctrl + wheel zooms. After a "
         "click, the wheel and the keys + &minus; 0 &larr; &rarr; zoom and move.</span>"
         "<output id=\"span\"></output></div>";
}

// Returns whether two curves differ. Drawing equal curves would hide that no change was made.
bool differ(const Column& a, const Column& b) { return !a.empty() && !b.empty() && a != b; }

struct PhasePlot {
  const char* id;
  const char* title;
  const char* text;
  const char* up;  // name and unit of the axis
  const char* across;
  const Column* across_values;
  std::vector<Curve> curves;
};

std::size_t phase_stride(const TimeAxis& axis) {
  return std::max<std::size_t>(1, axis.samples / kMostPhasePoints);
}

std::string phase_plot(const PhasePlot& plot, const TimeAxis& axis) {
  Chart chart{.title = plot.title,
              .x_label = plot.across,
              .y_label = plot.up,
              .width = 440.0,
              .height = 360.0};
  const auto thinned = [&](const Column& column) {
    Column some;
    for (std::size_t k = 0; k < axis.samples; k += phase_stride(axis)) some.push_back(column[k]);
    return some;
  };
  for (const Curve& curve : plot.curves) {
    const Column up = thinned(*curve.values);
    chart.lines.push_back(line_of({curve.name, curve.style, &up}, thinned(*plot.across_values)));
  }
  return figure(plot.id, plot.title, plot.text,
                fmt::format("{} against {}. For values over time, see the tables of those plots.",
                            plot.up, plot.across),
                "<div class=\"still\">" + chart_svg(chart) + "</div>", "");
}

nlohmann::json phase_data(const PhasePlot& plot, const TimeAxis& axis) {
  nlohmann::json curves = nlohmann::json::array();
  for (const Curve& curve : plot.curves) {
    nlohmann::json k_list = nlohmann::json::array();
    nlohmann::json x = nlohmann::json::array();
    nlohmann::json y = nlohmann::json::array();
    for (std::size_t k = 0; k < axis.samples; k += phase_stride(axis)) {
      k_list.push_back(k);
      put(x, (*plot.across_values)[k]);
      put(y, (*curve.values)[k]);
    }
    curves.push_back(
        {{"name", curve.name}, {"style", curve.style}, {"k", k_list}, {"x", x}, {"y", y}});
  }
  return {{"id", plot.id}, {"up", plot.up}, {"across", plot.across}, {"curves", curves}};
}

// The plots of one result. They refer to it and to the residuals.
class Plots {
 public:
  explicit Plots(const gap::Result& result)
      : result_(result),
        axis_(result.series),
        residual_before_(difference(result.series.pv, result.series.pv_before)),
        residual_after_(difference(result.series.pv, result.series.pv_after)),
        changed_(differ(result.series.pv_before, result.series.pv_after) ||
                 result.series.pv_before.empty()),
        given_name_(differ(result.series.pv_before, result.series.pv_after)
                        ? "model as given"
                        : "model as given, unchanged") {}
  Plots(const Plots&) = delete;
  Plots& operator=(const Plots&) = delete;

  bool drawable() const { return axis_.drawable() && has_values(result_.series.pv, axis_); }
  const TimeAxis& axis() const { return axis_; }

  // Returns the plots that have a curve.
  std::vector<TimePlot> over_time() const {
    std::vector<TimePlot> plots{trend()};
    for (TimePlot plot : {residual(), output()}) {
      if (!plot.curves.empty()) plots.push_back(std::move(plot));
    }
    return plots;
  }

  std::vector<PhasePlot> phases() const {
    const gap::Series& s = result_.series;
    std::vector<PhasePlot> phases;
    if (!has_values(s.co, axis_)) return phases;
    PhasePlot phase{.id = "phase",
                    .title = "PV over CO",
                    .text = "of the span of time that is shown above.",
                    .up = "PV units",
                    .across = "CO units",
                    .across_values = &s.co,
                    .curves = {}};
    add(phase.curves, "measured", "measured", s.pv);
    add(phase.curves, "model as given", "before", s.pv_before);
    if (changed_) add(phase.curves, "corrected model", "after", s.pv_after);
    phases.push_back(std::move(phase));
    if (!has_values(s.stem, axis_)) return phases;
    // The read-back separates the valve from the process after it.
    phases.push_back({"stem",
                      "Stem over CO",
                      "the valve up to its stem, as measured.",
                      "stem, CO units",
                      "CO units",
                      &s.co,
                      {{"measured", "measured", &s.stem}}});
    phases.push_back({"pv-stem",
                      "PV over stem",
                      "the plug and the process, as measured.",
                      "PV units",
                      "stem, CO units",
                      &s.stem,
                      {{"measured", "measured", &s.pv}}});
    return phases;
  }

 private:
  void add(std::vector<Curve>& curves, const char* name, const char* style,
           const Column& values) const {
    if (has_values(values, axis_)) curves.push_back({name, style, &values});
  }

  TimePlot trend() const {
    const gap::Series& s = result_.series;
    TimePlot pv{.id = "trend",
                .title = "PV",
                .text = result_.closed_loop
                            ? "measured and in a free closed-loop run of the model, driven by SP."
                            : "measured and in a free run of the model, driven by the measured CO.",
                .unit = "PV units",
                .height = 300.0,
                .curves = {}};
    add(pv.curves, "SP", "sp", s.sp);
    add(pv.curves, given_name_, "before", s.pv_before);
    if (changed_) add(pv.curves, "corrected model", "after", s.pv_after);
    add(pv.curves, "measured", "measured", s.pv);
    return pv;
  }

  TimePlot residual() const {
    TimePlot residual{.id = "residual",
                      .title = "Residual",
                      .text =
                          "measured PV minus model. Shaded: largest errors, darker for a larger "
                          "share. Dotted: the noise floor.",
                      .unit = "PV units",
                      .height = 230.0,
                      .curves = {},
                      .zero_line = true,
                      .floor = std::isfinite(result_.floor.rmse()) ? result_.floor.rmse() : 0.0,
                      .shades = shades_of(result_, axis_)};
    add(residual.curves, given_name_, "before", residual_before_);
    if (changed_) add(residual.curves, "corrected model", "after", residual_after_);
    return residual;
  }

  TimePlot output() const {
    const gap::Series& s = result_.series;
    TimePlot co{.id = "output",
                .title = "CO",
                .text = "as measured.",
                .unit = "CO units",
                .height = 200.0,
                .curves = {}};
    if (has_controller_gap(result_)) {
      co.text = "measured and as the model's controller gives it from the measured SP and PV.";
      add(co.curves, "controller as given", "before", s.co_before);
      if (differ(s.co_before, s.co_after) || s.co_before.empty()) {
        add(co.curves, "corrected controller", "after", s.co_after);
      }
    }
    add(co.curves, "measured", "measured", s.co);
    return co;
  }

  const gap::Result& result_;
  TimeAxis axis_;
  Column residual_before_, residual_after_;
  bool changed_;  // by the corrections
  const char* given_name_;
};

}  // namespace

bool has_controller_gap(const gap::Result& result) {
  for (const gap::FoundEffect& effect : result.effects) {
    if (effect.block == effects::Block::controller) return true;
  }
  for (const gap::Located& located : result.located) {
    if (located.by == gap::LocatedBy::block && located.block == effects::Block::controller &&
        located.share_of_gap >= kControllerShare) {
      return true;
    }
  }
  return false;
}

std::string gap_plots_html(const gap::Result& result) {
  const Plots plots(result);
  if (!plots.drawable()) return "";
  const TimeAxis& axis = plots.axis();
  std::string text = "<div id=\"plots\">" + tools(result, axis);
  nlohmann::json data = {{"samples", axis.samples},          {"first_s", axis.first_s},
                         {"period_s", axis.period_s},        {"held_from_s", nullptr},
                         {"plots", nlohmann::json::array()}, {"phases", nlohmann::json::array()}};
  if (holds_back(axis, result.holdout_from_s)) data["held_from_s"] = result.holdout_from_s;
  for (const TimePlot& plot : plots.over_time()) {
    text += time_plot(plot, axis, result.holdout_from_s);
    data["plots"].push_back(time_data(plot));
  }
  text += "</div>\n<div class=\"pair\">";
  for (const PhasePlot& plot : plots.phases()) {
    text += phase_plot(plot, axis);
    data["phases"].push_back(phase_data(plot, axis));
  }
  // The data has only names of this file and numbers, so no text can end the element.
  return text + "</div>\n<script type=\"application/json\" id=\"data\">" + data.dump() +
         "</script>\n";
}

}  // namespace loopwarden::workbench
