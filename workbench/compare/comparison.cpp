// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/frame.hpp"
#include "workbench/compare/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/numeric/statistics.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/files/output_files.hpp"
#include "base/parallel.hpp"
#include "workbench/command_line/progress.hpp"

namespace loopwarden::workbench {
namespace {

constexpr double kNoticeable = 0.05;   // relative
constexpr double kShownPercent = 5.0;  // severity of the pictures

struct Outcome {
  CompareCase one;
  std::vector<std::string> names;
  std::vector<CompareResult> results;  // the first is without compensator
};

std::vector<Outcome> run_all(const plant::LoopModel& model, ComparedPlants plants,
                             double estimate) {
  std::vector<Outcome> outcomes;
  for (CompareCase& one : compare_cases(model, plants))
    outcomes.push_back({std::move(one), {}, {}});
  Progress progress("compare", outcomes.size());
  base::parallel_for(
      outcomes.size(), threads(0),
      [&](std::size_t i) {
        Outcome& outcome = outcomes[i];
        for (const Contender& contender : contenders(outcome.one, estimate)) {
          outcome.names.push_back(contender.name);
          outcome.results.push_back(compare_one(outcome.one, contender));
        }
      },
      [&](std::size_t done) { progress.update(done); });
  return outcomes;
}

double median_or_none(std::vector<double> values) {
  return values.empty() ? std::nan("") : numeric::median(std::move(values));
}

// One line of a table: factors relative to no compensator, medians over the cases of a fault.
struct Line {
  std::string name;
  double falls = 0.0;  // share of cases whose variability falls by more than 5 %
  double rises = 0.0;  // ... rises by more than 5 %
  double variability = 0.0, worst = 0.0, absolute_error = 0.0, amplitude = 0.0, period = 0.0;
  double overshoot_percent = 0.0;  // not a factor
  double travel = 0.0, reversals = 0.0;
};

double factor(double value, double base, double least) {
  return (std::abs(value) + least) / (std::abs(base) + least);
}

std::vector<Line> lines_of(const std::vector<Outcome>& outcomes, const std::string& fault,
                           double pv_span) {
  // A smaller variability counts as zero. On a healthy loop the factors would be 0 / 0.
  const double least = 1e-4 * pv_span;
  std::vector<Line> lines;
  const Outcome& any = outcomes.front();
  for (std::size_t c = 0; c < any.names.size(); ++c) {
    std::map<std::string, std::vector<double>> values;
    Line line{.name = any.names[c]};
    double cases = 0.0;
    for (const Outcome& outcome : outcomes) {
      if (outcome.one.fault != fault) continue;
      const CompareResult& with = outcome.results[c];
      const CompareResult& none = outcome.results.front();
      const double variability = factor(with.variability, none.variability, least);
      cases += 1.0;
      line.falls += variability < 1.0 - kNoticeable ? 1.0 : 0.0;
      line.rises += variability > 1.0 + kNoticeable ? 1.0 : 0.0;
      line.worst = std::max(line.worst, variability);
      values["variability"].push_back(variability);
      values["error"].push_back(factor(with.absolute_error, none.absolute_error, least));
      values["amplitude"].push_back(factor(with.amplitude, none.amplitude, least));
      if (with.period_s > 0.0 && none.period_s > 0.0) {
        values["period"].push_back(with.period_s / none.period_s);
      }
      values["overshoot"].push_back(100.0 * with.overshoot);
      values["travel"].push_back(factor(with.travel_per_hour, none.travel_per_hour, 1.0));
      values["reversals"].push_back(factor(with.reversals_per_hour, none.reversals_per_hour, 1.0));
    }
    line.falls /= cases;
    line.rises /= cases;
    line.variability = median_or_none(values["variability"]);
    line.absolute_error = median_or_none(values["error"]);
    line.amplitude = median_or_none(values["amplitude"]);
    line.period = median_or_none(values["period"]);
    line.overshoot_percent = median_or_none(values["overshoot"]);
    line.travel = median_or_none(values["travel"]);
    line.reversals = median_or_none(values["reversals"]);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<std::string> faults_in(const std::vector<Outcome>& outcomes) {
  std::vector<std::string> names;
  for (const Outcome& outcome : outcomes) {
    if (std::find(names.begin(), names.end(), outcome.one.fault) == names.end()) {
      names.push_back(outcome.one.fault);
    }
  }
  return names;
}

const std::vector<std::string>& comparison_heads() {
  static const std::vector<std::string> names{"compensator", "falls %", "rises %",   "variability",
                                              "worst",       "error",   "amplitude", "period",
                                              "over %",      "travel",  "reversals"};
  return names;
}

std::string shown(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("-");
}

std::vector<std::string> cells(const Line& line) {
  return {line.name,
          fmt::format("{:.0f}", 100.0 * line.falls),
          fmt::format("{:.0f}", 100.0 * line.rises),
          shown(line.variability),
          shown(line.worst),
          shown(line.absolute_error),
          shown(line.amplitude),
          shown(line.period),
          fmt::format("{:.0f}", line.overshoot_percent),
          shown(line.travel),
          shown(line.reversals)};
}

void print_text(const std::vector<Outcome>& outcomes, double pv_span, double estimate) {
  fmt::print(
      "{} cases, {} settings each; compensators sized by {:g} of the true severity.\n"
      "Factors against the same loop without compensator, medians; falls, rises: share of "
      "cases whose\nvariability (RMS of settled SP - PV) changes by more than 5 %; error: integral "
      "of |SP - PV| with the moves;\nover: overshoot of set-point moves, % of the move.\n",
      outcomes.size(), outcomes.front().names.size(), estimate);
  for (const std::string& fault : faults_in(outcomes)) {
    fmt::print("\n{}\n", fault);
    const auto row = [](const std::vector<std::string>& c) {
      fmt::print("  {:<15} {:>7} {:>7} {:>11} {:>7} {:>6} {:>9} {:>7} {:>6} {:>8} {:>9}\n", c[0],
                 c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10]);
    };
    row(comparison_heads());
    for (const Line& line : lines_of(outcomes, fault, pv_span)) row(cells(line));
  }
}

void print_json(const std::vector<Outcome>& outcomes) {
  nlohmann::json list = nlohmann::json::array();
  for (const Outcome& outcome : outcomes) {
    for (std::size_t c = 0; c < outcome.names.size(); ++c) {
      const CompareResult& r = outcome.results[c];
      list.push_back({{"fault", outcome.one.fault},
                      {"percent", outcome.one.percent},
                      {"plant", outcome.one.plant},
                      {"noise", outcome.one.noise},
                      {"compensator", outcome.names[c]},
                      {"variability", r.variability},
                      {"absolute_error", r.absolute_error},
                      {"amplitude", r.amplitude},
                      {"period_s", r.period_s},
                      {"overshoot", r.overshoot},
                      {"mean_error", r.mean_error},
                      {"travel_per_hour", r.travel_per_hour},
                      {"reversals_per_hour", r.reversals_per_hour}});
    }
  }
  show_json(nlohmann::json{{"cases", std::move(list)}});
}

// Draws PV with each compensator at the second and third set point, on the model's own plant.
std::string trends(const Outcome& outcome, double estimate) {
  std::vector<Chart> charts;
  for (const Contender& contender : contenders(outcome.one, estimate)) {
    plant::LoopModel model = outcome.one.model;
    contender.fit(model.controller);
    const analysis::SimulatedRecord r = analysis::run_model(model, 4.0 * outcome.one.hold_s);
    const double h = model.sample_time_s;
    const auto from = static_cast<std::size_t>(1.7 * outcome.one.hold_s / h);
    const auto to = static_cast<std::size_t>(2.3 * outcome.one.hold_s / h);
    const auto cut = [&](const std::vector<double>& column) {
      return std::vector<double>(column.begin() + static_cast<std::ptrdiff_t>(from),
                                 column.begin() + static_cast<std::ptrdiff_t>(to));
    };
    const std::vector<double> t = time_axis(to - from, h);
    Chart chart{.title = contender.name,
                .x_label = "s",
                .y_label = "PV, SP",
                .width = 380.0,
                .height = 180.0};
    chart.lines.push_back({"", palette::kGrey, t, cut(r.sp), true});
    chart.lines.push_back({"", palette::kBlue, t, cut(r.true_pv)});
    const double middle = r.sp[from];
    const double span = outcome.one.model.transmitter.span();
    chart.y_range = PlotRange{middle - 0.12 * span, middle + 0.2 * span};
    charts.push_back(std::move(chart));
  }
  return chart_sheet(
      fmt::format("{}, {:g} % of the CO range", outcome.one.fault, outcome.one.percent), charts, 3);
}

// Draws variability and stem travel of each compensator as factors on a logarithmic scale.
std::string overview(const std::vector<Outcome>& outcomes, double pv_span) {
  std::vector<Chart> charts;
  for (const std::string& fault : faults_in(outcomes)) {
    const std::vector<Line> lines = lines_of(outcomes, fault, pv_span);
    Chart chart{.title = fault,
                .x_label = "factor against none",
                .y_label = "",
                .width = 380.0,
                .height = 240.0};
    ChartLine variability{"variability", palette::kBlue, {}, {}, false, true};
    ChartLine travel{"stem travel", palette::kVermilion, {}, {}, false, true};
    for (std::size_t c = 1; c < lines.size(); ++c) {
      const double y = static_cast<double>(lines.size() - c);
      chart.y_names.emplace_back(
          y, lines[c].name.starts_with("jacket ") ? lines[c].name.substr(7) : lines[c].name);
      variability.x.push_back(std::log10(lines[c].variability));
      variability.y.push_back(y + 0.12);
      travel.x.push_back(std::log10(lines[c].travel));
      travel.y.push_back(y - 0.12);
    }
    const double top = static_cast<double>(lines.size());
    chart.lines = {variability, travel, {"", palette::kGrey, {0.0, 0.0}, {0.0, top}, true}};
    chart.logarithmic_x = true;
    chart.x_range = PlotRange{-2.0, 2.0};
    chart.y_range = PlotRange{0.3, top - 0.3};
    charts.push_back(std::move(chart));
  }
  return chart_sheet("Compensators: medians over the grid", charts, 3);
}

void write_report(const ComparisonOptions& options, const std::vector<Outcome>& outcomes,
                  double pv_span) {
  const std::filesystem::path folder = options.out;
  OutputFiles files({options.model});
  files.make_folder(folder);
  const std::string summary = overview(outcomes, pv_span);
  files.add(folder / "overview.svg", summary);
  std::string body = fmt::format(
      "<p>{} cases: faults of 2, 5 and 10 % of the CO range, {}, with and without noise, four set "
      "points. Compensators are sized by {:g} of the true severity. Factors are medians against "
      "the same loop without compensator.</p>\n{}",
      outcomes.size(), options.plants == ComparedPlants::own ? "the model's plant" : "three plants",
      options.estimate, summary);
  for (const std::string& fault : faults_in(outcomes)) {
    body += "<h2>" + escaped(fault) + "</h2>\n<table><tr>";
    for (const std::string& head : comparison_heads()) body += "<th>" + head + "</th>";
    body += "</tr>\n";
    for (const Line& line : lines_of(outcomes, fault, pv_span)) {
      body += "<tr>";
      for (const std::string& cell : cells(line)) body += "<td>" + escaped(cell) + "</td>";
      body += "</tr>\n";
    }
    body += "</table>\n";
    for (const Outcome& outcome : outcomes) {
      const bool picture = outcome.one.fault == fault && outcome.one.plant == "own" &&
                           outcome.one.noise > 0.0 &&
                           (outcome.one.percent == kShownPercent || outcome.one.percent == 0.0);
      if (!picture) continue;
      const std::string svg = trends(outcome, options.estimate);
      std::string file = fault.substr(0, fault.find(','));
      if (fault.ends_with("J = S")) file += "-j-equals-s";
      std::replace(file.begin(), file.end(), ' ', '-');
      files.add(folder / (file + ".svg"), svg);
      body += svg;
    }
  }
  files.add(folder / "report.html",
            html_page("Compensators on " + std::filesystem::path(options.model).filename().string(),
                      body));
  files.commit();
}

}  // namespace

int run_comparison(const ComparisonOptions& options) {
  const plant::LoopModel model = load_model(options.model);
  const double pv_span = model.transmitter.span();
  const std::vector<Outcome> outcomes = run_all(model, options.plants, options.estimate);
  if (!options.out.empty()) write_report(options, outcomes, pv_span);
  options.json ? print_json(outcomes) : print_text(outcomes, pv_span, options.estimate);
  return kExitOk;
}

void add_comparison_options(Command& command, ComparisonOptions& options) {
  command.required("model", options.model, "loop model, YAML; its own faults are ignored");
  command.setting("--estimate", options.estimate,
                  "size for which the compensators are set, share of the true severity",
                  between(0.05, 3.0));
  command.option("--out", options.out, "folder for report.html and pictures");
  command.flag("--json", options.json, "print every case as JSON");
}

}  // namespace loopwarden::workbench
