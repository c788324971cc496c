// SPDX-License-Identifier: Apache-2.0
// Draws one measured record of plant 1: measured, published and corrected, with the residual below.
#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "lab/plant1/plant1_study.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::lab {

std::string plant1_picture(const Plant1Outcome& row) {
  namespace palette = workbench::palette;
  const Plant1Record& record = row.record;
  const std::vector<double> time = workbench::time_axis(record.pv.size(), kPlant1PeriodS);
  std::vector<double> residual(record.pv.size());
  for (std::size_t k = 0; k < residual.size(); ++k)
    residual[k] = record.pv[k] - row.corrected_pv[k];
  workbench::Chart flow{
      .title = "PV", .x_label = "s", .y_label = "L/min", .width = 920.0, .height = 290.0};
  flow.lines = {
      {.name = fmt::format("published model, fit {:.1f} %", fit_percent(row.published_misfit)),
       .colour = palette::kBefore,
       .x = time,
       .y = row.published_pv,
       .dashed = true},
      {.name = "measured", .colour = palette::kMeasured, .x = time, .y = record.pv},
      {.name = fmt::format("corrected model, fit {:.1f} %", fit_percent(row.corrected_misfit)),
       .colour = palette::kAfter,
       .x = time,
       .y = row.corrected_pv}};
  workbench::Chart rest{.title = "measured - corrected",
                        .x_label = "s",
                        .y_label = "L/min",
                        .width = 920.0,
                        .height = 150.0};
  rest.lines = {{.name = "", .colour = palette::kAfter, .x = time, .y = std::move(residual)}};
  rest.y_range = workbench::PlotRange{-1.5, 1.5};
  return workbench::chart_sheet(fmt::format("{} ({})", record.name, record.condition), {flow, rest},
                                1);
}

}  // namespace loopwarden::lab
