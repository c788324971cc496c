// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/diagnosis_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/diagnosis/time_scales.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/numeric/statistics.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Diagnosis;
using diagnosis::DiagnosisVerdict;

constexpr std::size_t kDeadTimes = 12;
constexpr double kLongestDeadTime = 0.35;                     // of the movement's period
constexpr std::array kLags{0.0, 0.025, 0.05, 0.1, 0.2, 0.4};  // of the movement's period

}  // namespace

ValveView valve_view(std::span<const double> pv, std::span<const double> co, double band) {
  effects::Backlash play(band);
  play.reset(co.front());
  std::vector<double> valve(co.size());
  std::transform(co.begin(), co.end(), valve.begin(), [&](double u) { return play.step(u); });
  ValveView view;
  const double period = diagnosis::movement_period(co, pv);
  double best = 0.0;
  for (const double share : kLags) {
    const double keep = share > 0.0 ? std::exp(-1.0 / (share * period)) : 0.0;
    std::vector<double> behind(valve.size());
    double state = valve.front();
    std::transform(valve.begin(), valve.end(), behind.begin(),
                   [&](double v) { return state = keep * state + (1.0 - keep) * v; });
    const auto longest =
        std::min(static_cast<std::size_t>(kLongestDeadTime * period), co.size() / 4);
    const std::size_t step = std::max<std::size_t>(1, longest / kDeadTimes);
    for (std::size_t dead = 0; dead <= longest; dead += step) {
      const std::span<const double> earlier(behind.data(), behind.size() - dead);
      const auto later = pv.subspan(dead);
      const double r = numeric::correlation(earlier, later);
      if (r * r <= best) continue;
      best = r * r;
      view.dead_time = dead;
      const double gain = r * std::sqrt(numeric::variance(later) / numeric::variance(earlier));
      const double level = numeric::mean(later) - gain * numeric::mean(earlier);
      view.followed.assign(pv.size(), std::numeric_limits<double>::quiet_NaN());
      for (std::size_t k = dead; k < pv.size(); ++k) {
        view.followed[k] = level + gain * behind[k - dead];
      }
    }
  }
  view.standing.assign(co.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 1; k < co.size(); ++k) {
    if (valve[k] == valve[k - 1] && co[k] != co[k - 1]) view.standing[k] = co[k];
  }
  return view;
}

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
            escaped(fmt::format("{}, {} to {}: {}", w.file, time_text(loop, w, w.from_s),
                                time_text(loop, w, w.to_s), headline(d, loop.co_range))) +
            "</h2>\n";
    const std::vector<double> time = sample_times(w);
    const std::string pv_unit = unit_text(loop, w, record::Role::pv, "PV units");
    const std::string co_unit = unit_text(loop, w, record::Role::co, "CO units");
    Chart trend{.title = "PV", .x_label = "s", .y_label = pv_unit};
    trend.lines.push_back({.name = "PV", .x = time, .y = p.raw_pv});
    if (!p.raw_sp.empty()) {
      trend.lines.push_back(
          {.name = "SP", .colour = chart_colour(1), .x = time, .y = p.raw_sp, .dashed = true});
    }
    Chart plane{.title = "PV over CO", .x_label = co_unit, .y_label = pv_unit};
    plane.lines.push_back({.name = "PV over CO", .x = p.raw_co, .y = p.raw_pv});
    Chart output{.title = "CO", .x_label = "s", .y_label = co_unit};
    output.lines.push_back({.name = "CO", .x = time, .y = p.raw_co});
    const double band = d.band.band;
    if (d.verdict == DiagnosisVerdict::valve_effect && band > 0.0) {
      const ValveView view = valve_view(p.raw_pv, p.raw_co, band);
      output.lines.push_back({.name = "CO moves, the valve does not",
                              .colour = chart_colour(2),
                              .x = time,
                              .y = view.standing});
      trend.lines.push_back({.name = "PV predicted by the fitted band",
                             .colour = chart_colour(2),
                             .x = time,
                             .y = view.followed});
      plane.lines.push_back(
          {.name = "fitted band", .colour = chart_colour(2), .x = p.raw_co, .y = view.followed});
    }
    body += chart_sheet("", {trend, output, plane}, 3);
  }
  return html_page("Diagnosis", body);
}

}  // namespace loopwarden::workbench
