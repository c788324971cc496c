// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/diagnosis_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/plant/backlash.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Diagnosis;
using diagnosis::Grade;
using diagnosis::Verdict;

// CO through the fitted play, on PV's scale, and what of PV lies within a band.
struct FittedBand {
  std::vector<double> followed;  // PV units
  std::vector<double> stuck;     // PV where the play stands still while CO moves, else NaN
};
FittedBand fitted_band(const Diagnosis& d, double band) {
  const auto& co = d.prepared.raw_co;
  const auto& pv = d.prepared.raw_pv;
  plant::Backlash play(band);
  play.reset(co.front());
  std::vector<double> v(co.size());
  std::transform(co.begin(), co.end(), v.begin(), [&](double u) { return play.step(u); });
  const double spread = std::sqrt(diagnosis::variance(v));
  const double gain =
      spread > 0.0 ? diagnosis::correlation(v, pv) * std::sqrt(diagnosis::variance(pv)) / spread
                   : 0.0;
  FittedBand fit;
  const double v_mean = diagnosis::mean(v);
  const double pv_mean = diagnosis::mean(pv);
  for (std::size_t k = 0; k < v.size(); ++k) {
    fit.followed.push_back(pv_mean + gain * (v[k] - v_mean));
    const bool stands = k > 0 && v[k] == v[k - 1] && co[k] != co[k - 1];
    fit.stuck.push_back(stands ? pv[k] : std::numeric_limits<double>::quiet_NaN());
  }
  return fit;
}

}  // namespace

std::vector<double> sample_times(const DiagnosedWindow& w) {
  const auto& p = w.diagnosis.prepared;
  std::vector<double> time = time_axis(p.raw_pv.size(), w.period_s);
  for (double& t : time) t += w.from_s + static_cast<double>(p.from) * w.period_s;
  return time;
}

std::string diagnosis_page(const DiagnosedLoop& loop) {
  std::string body = "<pre>" + escaped(diagnosis_text(loop)) + "</pre>\n";
  for (const DiagnosedWindow& w : loop.windows) {
    const Diagnosis& d = w.diagnosis;
    const auto& p = d.prepared;
    if (p.raw_pv.empty()) continue;
    body += "<h2>" +
            escaped(fmt::format("{}, {:g} to {:g} s: {}", w.file, w.from_s, w.to_s,
                                headline(d, loop.co_range))) +
            "</h2>\n";
    const std::vector<double> time = sample_times(w);
    Chart trend{.title = "PV", .x_label = "s", .y_label = "PV units"};
    trend.lines.push_back({.name = "PV", .x = time, .y = p.raw_pv});
    if (!p.raw_sp.empty()) {
      trend.lines.push_back(
          {.name = "SP", .colour = chart_colour(1), .x = time, .y = p.raw_sp, .dashed = true});
    }
    Chart plane{.title = "PV over CO", .x_label = "CO units", .y_label = "PV units"};
    plane.lines.push_back({.name = "PV over CO", .x = p.raw_co, .y = p.raw_pv});
    const double band = d.grade == Grade::seen ? d.hammerstein.band : d.play.band;
    if (d.verdict == Verdict::valve_effect && band > 0.0) {
      const FittedBand fit = fitted_band(d, band);
      trend.lines.push_back({.name = "CO moves, the valve does not",
                             .colour = chart_colour(2),
                             .x = time,
                             .y = fit.stuck});
      plane.lines.push_back(
          {.name = "fitted band", .colour = chart_colour(2), .x = p.raw_co, .y = fit.followed});
    }
    Chart output{.title = "CO", .x_label = "s", .y_label = "CO units"};
    output.lines.push_back({.name = "CO", .x = time, .y = p.raw_co});
    body += chart_sheet("", {trend, output, plane}, 3);
  }
  return html_page("Diagnosis", body);
}

}  // namespace loopwarden::workbench
