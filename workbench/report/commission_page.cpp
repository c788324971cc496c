// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/commission_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/text.hpp"
#include "model/effects/catalogue.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/text/commission_json.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::size_t kDrawnSamples = 1600;

// Returns every n-th value, so that a page of an hour stays small.
std::vector<double> thinned(const std::vector<double>& values, std::size_t every) {
  std::vector<double> out;
  for (std::size_t k = 0; k < values.size(); k += every) out.push_back(values[k]);
  return out;
}

std::string stages_table(const twin::Commissioning& made) {
  std::string rows;
  for (const twin::Stage& stage : made.stages) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(stage.name),
                        plain_number(stage.rmse), plain_number(stage.holdout_rmse));
  }
  return "<table><thead><tr><th>model</th><th>rmse of PV, fitted part, PV units</th>"
         "<th>held-back part</th></tr></thead><tbody>" +
         rows + "</tbody></table>\n";
}

std::string pictures(const twin::Commissioning& made, const numeric::LoopRecord& record) {
  const std::size_t every = std::max<std::size_t>(1, record.size() / kDrawnSamples);
  const std::vector<double> time =
      time_axis((record.size() + every - 1) / every, record.period_s * static_cast<double>(every));
  const std::vector<double> measured = thinned(record.pv, every);
  std::string text;
  for (std::size_t i = 0; i < made.stages.size(); ++i) {
    const twin::Stage& stage = made.stages[i];
    if (stage.pv.size() != record.size()) continue;
    Chart chart{
        .title = fmt::format("{}: {} PV units", stage.name, plain_number(stage.holdout_rmse)),
        .x_label = "s",
        .y_label = "PV units",
        .width = 900.0,
        .height = 200.0};
    chart.lines.push_back({.name = "measured", .colour = palette::kGrey, .x = time, .y = measured});
    chart.lines.push_back({.name = "model under the measured CO",
                           .colour = chart_colour(i == 0 ? 1 : 0),
                           .x = time,
                           .y = thinned(stage.pv, every)});
    text += chart_svg(chart) + "\n";
  }
  return text;
}

std::string effects_list(const twin::Commissioning& made) {
  if (made.effects.empty()) return "";
  std::string text = "<h2>Missing effects, in the order of their discovery</h2>\n<ul>\n";
  for (const gap::FoundEffect& effect : made.effects) {
    const effects::Descriptor* info = effects::find_word(effect.spec.name);
    std::string size;
    for (const auto& [name, value] : effect.spec.parameters) {
      size += fmt::format(" {} {}", name, plain_number(value));
    }
    text += fmt::format("<li><b>{}</b>{}: {}. {}</li>\n", escaped(effect.spec.name), escaped(size),
                        info != nullptr ? escaped(info->meaning) : "", escaped(effect.evidence));
  }
  return text + "</ul>\n";
}

}  // namespace

std::string commission_page(const twin::Commissioning& made,
                            const CommissionDetectability& seen_here,
                            const numeric::LoopRecord& record, double seconds) {
  std::string body = fmt::format("<p><b>{}</b>: {}</p>\n",
                                 base::in_words(twin::to_text(made.outcome)), escaped(made.why));
  for (const std::string& note : made.notes) body += fmt::format("<p>{}</p>\n", escaped(note));
  if (!seen_here.twin.empty()) {
    body += "<h2>Detection limits of the twin</h2>\n<table><tbody>";
    for (const twin::TwinSeen& seen : seen_here.twin) {
      body += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", to_text(seen.change),
                          escaped(seen_text(seen)));
    }
    body += "</tbody></table>\n";
  }
  if (const std::optional<twin::Detectability>& detectability = seen_here.specialists) {
    body +=
        "<h2>Detection limits of the specialists</h2>\n<p>Found in 95 % of the simulated windows "
        "with a set-point move of this loop's size, with its noise and "
        "disturbance.</p>\n<table><tbody>";
    for (const twin::Seen& seen : detectability->seen) {
      body += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", specialist::to_text(seen.condition),
                          escaped(seen_text(seen)));
    }
    body += fmt::format(
        "</tbody></table>\n<p>False alarms: {} in {:.0f} simulated healthy hours (95 % upper "
        "bound: {:.0f} per year).</p>\n",
        detectability->false_alarms, detectability->simulated_years * 8766.0,
        detectability->false_alarms_per_year);
  }
  if (!made.stages.empty()) {
    body += "<h2>Measured against the model, step by step</h2>\n" + stages_table(made);
    if (made.gap) {
      body += fmt::format(
          "<p>Noise floor: {} PV units.{}</p>\n", plain_number(made.gap->floor.rmse()),
          std::isfinite(made.closed)
              ? fmt::format(" Gap closed on the held-back part: {:.1f} %.", 100.0 * made.closed)
              : "");
    }
    body += pictures(made, record);
  }
  body += effects_list(made);
  body += fmt::format("<p>{:.0f} s of work.</p>\n", seconds);
  return html_page("Commissioning", body);
}

}  // namespace loopwarden::workbench
