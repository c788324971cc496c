// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/effect_picture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "model/control/loop_controller.hpp"
#include "model/effects/catalogue.hpp"
#include "model/plant/simulated_loop.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::workbench {
namespace {

using Column = std::vector<double>;
using effects::Block;

constexpr double kDuration = 400.0;  // s
constexpr double kTimeWidth = 476.0;
constexpr double kPhaseWidth = 284.0;

struct LoopRun {
  Column sp, pv, co, flow;  // flow: CO units, flow through the valve
};

LoopRun run_loop(const plant::LoopModel& model) {
  plant::SimulatedLoop loop(model);
  effects::EffectChain valve;
  for (const effects::EffectSpec& spec : model.valve_effects) {
    valve.add(effects::make_effect(spec, {.sample_time_s = model.sample_time_s,
                                          .output_low = model.controller.pid.output_low,
                                          .output_high = model.controller.pid.output_high}));
  }
  LoopRun run;
  const auto samples = static_cast<std::size_t>(std::lround(kDuration / model.sample_time_s));
  for (std::size_t k = 0; k < samples; ++k) {
    const plant::LoopSample s = loop.step();
    run.sp.push_back(s.sp);
    run.pv.push_back(s.pv);
    run.co.push_back(s.co);
    run.flow.push_back(k == 0 ? valve.reset(s.co, s.time_s) : valve.step(s.co, s.time_s));
  }
  return run;
}

plant::LoopModel with_effect(plant::LoopModel model, const effects::Example& example) {
  switch (example.block) {
    case Block::controller:
      model.controller.pid.gains.kp = example.spec.parameters.at("kp");
      model.controller.pid.gains.ki = example.spec.parameters.at("ki");
      break;
    case Block::valve: model.valve_effects.push_back(example.spec); break;
    case Block::process: model.process_effects.push_back(example.spec); break;
    case Block::transmitter: model.transmitter_effects.push_back(example.spec); break;
    case Block::disturbance: model.disturbances.push_back(example.spec); break;
  }
  return model;
}

// Returns the measured signal minus that of the model without the effect for the same input.
Column residual_of(const LoopRun& run, const plant::LoopModel& model, Block block) {
  Column residual;
  if (block == Block::controller) {
    control::LoopController controller(model.controller, model.sample_time_s, run.sp.front(),
                                       run.co.front());
    controller.request_mode(control::Mode::automatic);
    for (std::size_t k = 0; k < run.pv.size(); ++k) {
      controller.request_set_point(run.sp[k]);
      residual.push_back(run.co[k] - controller.step({.process_variable = run.pv[k]}).output);
    }
    return residual;
  }
  plant::Plant plant(model, model.scenario.seed);
  plant.reset(run.co.front());
  for (std::size_t k = 0; k < run.co.size(); ++k) {
    residual.push_back(run.pv[k] - plant.process_variable());
    plant.step(run.co[k]);
  }
  return residual;
}

// Name and colour of a curve in all panels.
struct PanelCurve {
  const char* name;
  const char* colour;
  const Column* values;
  bool dashed = false;
};
PanelCurve with_it(const Column& values) { return {"with the effect", palette::kAfter, &values}; }
PanelCurve without_it(const Column& values) {
  return {"without it", palette::kBefore, &values, true};
}

PlotRange range_of_curves(const std::vector<PanelCurve>& curves, double least_span) {
  std::vector<std::span<const double>> columns;
  for (const PanelCurve& curve : curves) columns.emplace_back(*curve.values);
  PlotRange range = range_of(columns, 0.06);
  // A negligible difference must look negligible.
  if (const double lacks = least_span - range.span(); lacks > 0.0) {
    range.low -= lacks / 2.0;
    range.high += lacks / 2.0;
  }
  return range;
}

Chart time_panel(const char* title, double height, const std::vector<PanelCurve>& curves,
                 double least_span, const plant::LoopModel& model, bool legend) {
  Chart chart{.title = title, .x_label = "s", .y_label = "", .width = kTimeWidth, .height = height};
  for (const PanelCurve& curve : curves) {
    chart.lines.push_back({.name = legend ? curve.name : "",
                           .colour = curve.colour,
                           .x = time_axis(curve.values->size(), model.sample_time_s),
                           .y = *curve.values,
                           .dashed = curve.dashed});
  }
  chart.x_range = PlotRange{0.0, kDuration};
  chart.y_range = range_of_curves(curves, least_span);
  return chart;
}

Chart phase_panel(const char* title,
                  const std::vector<std::pair<PanelCurve, const Column*>>& curves) {
  Chart chart{.title = title,
              .x_label = "CO, V",
              .y_label = "",
              .width = kPhaseWidth,
              .height = kPhaseWidth};
  for (const auto& [curve, co] : curves) {
    chart.lines.push_back(
        {.name = "", .colour = curve.colour, .x = *co, .y = *curve.values, .dashed = curve.dashed});
  }
  return chart;
}

}  // namespace

std::vector<effects::Example> effect_examples() {
  std::vector<effects::Example> all;
  for (const effects::Descriptor& effect : effects::vocabulary()) {
    all.insert(all.end(), effect.examples.begin(), effect.examples.end());
  }
  return all;
}

plant::LoopModel effect_example_model() {
  plant::LoopModel model;
  model.sample_time_s = 0.1;
  model.controller.pid.gains = {.kp = 0.3494, .ki = 0.0400074};
  model.controller.pid.output_low = 0.0;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.scenario = {.duration_s = kDuration,
                    .set_point = {{0.0, 4.0}, {20.0, 5.5}, {220.0, 4.5}, {310.0, 6.0}},
                    .faults = {},
                    .seed = 1};
  return model;
}

std::string example_text(const effects::Example& example) {
  std::string text = example.spec.name;
  for (const auto& [name, value] : example.spec.options) {
    text += fmt::format(", {} {}", name, value);
  }
  for (const auto& [name, value] : example.spec.parameters) {
    text += fmt::format(", {} {:g}", name, value);
  }
  return text;
}

std::string effect_picture_svg(const effects::Example& example) {
  const plant::LoopModel model = effect_example_model();
  const LoopRun plain = run_loop(model);
  const LoopRun run = run_loop(with_effect(model, example));
  const Column residual = residual_of(run, model, example.block);
  const bool controller = example.block == Block::controller;
  const bool valve = example.block == Block::valve;

  const std::vector<Chart> panels{
      time_panel(
          "PV and SP, L/min", 220.0,
          {{"set point", palette::kSetPoint, &run.sp, true}, without_it(plain.pv), with_it(run.pv)},
          0.0, model, true),
      time_panel("CO, V", 140.0, {without_it(plain.co), with_it(run.co)}, 0.5, model, false),
      time_panel(controller ? "CO less the model's controller, V"
                            : "residual: PV less the model without it, same CO, L/min",
                 130.0, {with_it(residual)}, 0.2, model, false)};
  const Chart phase =
      valve ? phase_panel("flow out of the valve over CO, V",
                          {{without_it(plain.flow), &plain.co}, {with_it(run.flow), &run.co}})
            : phase_panel("PV over CO, L/min",
                          {{without_it(plain.pv), &plain.co}, {with_it(run.pv), &run.co}});
  std::string groups = chart_group(phase, kTimeWidth, kSheetTitle);
  double top = kSheetTitle;
  for (const Chart& panel : panels) {
    groups += chart_group(panel, 0.0, top);
    top += chart_height(panel);
  }
  return sheet_svg(example_text(example), kTimeWidth + kPhaseWidth, top, groups);
}

}  // namespace loopwarden::workbench
