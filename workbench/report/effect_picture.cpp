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
#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {
namespace {

using Column = std::vector<double>;
using plant::Block;

constexpr double kDuration = 400.0;  // s
constexpr std::size_t kStretches = 900;
constexpr double kDots = 10.0;      // path units per unit of the picture
constexpr double kTolerance = 3.0;  // path units
constexpr double kLeft = 44.0;
constexpr double kTimeWidth = 420.0;
constexpr double kPhaseLeft = 520.0;
constexpr double kPhaseSize = 226.0;

struct LoopRun {
  Column sp, pv, co, flow;  // flow: CO units, what leaves the valve
};

LoopRun run_loop(const plant::LoopModel& model) {
  plant::SimulatedLoop loop(model);
  plant::EffectChain valve;
  for (const plant::EffectSpec& spec : model.valve_effects) {
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

// What the model without the effect makes of the same input, taken from what was measured.
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

struct Curve {
  const char* style;
  const Column* values;
};

PlotRange range_of_curves(const std::vector<Curve>& curves, double least_span) {
  std::vector<std::span<const double>> columns;
  for (const Curve& curve : curves) columns.emplace_back(*curve.values);
  PlotRange range = range_of(columns, 0.06);
  // What is all but nothing must look like it.
  if (const double lacks = least_span - range.span(); lacks > 0.0) {
    range.low -= lacks / 2.0;
    range.high += lacks / 2.0;
  }
  return range;
}

std::string up_ticks(double left, double top, double width, double height, const PlotRange& range,
                     int count) {
  std::string text;
  for (const Tick& tick : ticks(range, count)) {
    const double y = top + (range.high - tick.value) / range.span() * height;
    text += fmt::format(
        "<path class=\"g\" d=\"M{0} {1:.1f}h{2}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>\n",
        left, y, width, left - 5.0, y + 3.5, tick.text);
  }
  return text;
}

std::string across_ticks(double left, double top, double width, double height,
                         const PlotRange& range, int count, bool with_text) {
  std::string text;
  for (const Tick& tick : ticks(range, count)) {
    const double x = left + (tick.value - range.low) / range.span() * width;
    text += fmt::format("<path class=\"g\" d=\"M{:.1f} {}v{}\"/>", x, top, height);
    if (with_text) {
      text += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>", x,
                          top + height + 14.0, tick.text);
    }
    text += "\n";
  }
  return text;
}

std::string curve_path(const char* style, double left, double top,
                       std::span<const PlotPoint> points) {
  return fmt::format("<path class=\"{}\" transform=\"translate({} {}) scale({})\" d=\"{}\"/>\n",
                     style, left, top, 1.0 / kDots, path_data(simplified(points, kTolerance)));
}

std::string time_panel(double top, double height, const std::string& title,
                       const std::vector<Curve>& curves, double least_span, bool last) {
  const PlotRange range = range_of_curves(curves, least_span);
  std::string text = across_ticks(kLeft, top, kTimeWidth, height, {0.0, kDuration}, 6, last) +
                     up_ticks(kLeft, top, kTimeWidth, height, range, 4);
  for (const Curve& curve : curves) {
    const double samples = static_cast<double>(curve.values->size());
    std::vector<PlotPoint> points = decimated(*curve.values, range, kStretches);
    for (PlotPoint& p : points) {
      p.x = std::llround(static_cast<double>(p.x) / samples * kTimeWidth * kDots);
      p.y = std::llround(static_cast<double>(p.y) / kPlotHeight * height * kDots);
    }
    text += curve_path(curve.style, kLeft, top, points);
  }
  return text + fmt::format(
                    "<rect class=\"f\" x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\"/>"
                    "<text class=\"t\" x=\"{0}\" y=\"{4}\">{5}</text>\n",
                    kLeft, top, kTimeWidth, height, top - 5.0, title);
}

std::string phase_panel(const std::string& title,
                        const std::vector<std::pair<Curve, const Column*>>& curves) {
  constexpr double kTop = 40.0;
  std::vector<Curve> ups;
  std::vector<Curve> acrosses;
  for (const auto& [up, across] : curves) {
    ups.push_back(up);
    acrosses.push_back({"", across});
  }
  const PlotRange up = range_of_curves(ups, 0.0);
  const PlotRange across = range_of_curves(acrosses, 0.0);
  std::string text = across_ticks(kPhaseLeft, kTop, kPhaseSize, kPhaseSize, across, 5, true) +
                     up_ticks(kPhaseLeft, kTop, kPhaseSize, kPhaseSize, up, 5);
  for (const auto& [curve, co] : curves) {
    std::vector<PlotPoint> points;
    for (std::size_t k = 0; k < co->size(); ++k) {
      points.push_back(
          {std::llround(((*co)[k] - across.low) / across.span() * kPhaseSize * kDots),
           std::llround(up.down((*curve.values)[k]) / kPlotHeight * kPhaseSize * kDots), k == 0});
    }
    text += curve_path(curve.style, kPhaseLeft, kTop, points);
  }
  return text + fmt::format(
                    "<rect class=\"f\" x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{2}\"/>"
                    "<text class=\"t\" x=\"{0}\" y=\"{3}\">{4}</text>"
                    "<text x=\"{5}\" y=\"{6}\" text-anchor=\"end\">CO, V</text>\n",
                    kPhaseLeft, kTop, kPhaseSize, kTop - 5.0, title, kPhaseLeft + kPhaseSize,
                    kTop + kPhaseSize + 28.0);
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

  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 436\" role=\"img\" "
      "aria-labelledby=\"t d\">\n<title id=\"t\">{}</title>\n"
      "<desc id=\"d\">The same loop with the effect and without it.</desc>\n<style>"
      "rect.p{{fill:#fff}}rect.f{{fill:none;stroke:#b8bec5}}"
      "text{{font:11px system-ui,sans-serif;fill:#5b6570}}text.t{{fill:#1b1f24}}"
      "path{{fill:none;stroke-width:1.4;stroke-linejoin:round;vector-effect:non-scaling-stroke}}"
      ".g{{stroke:#e7eaee;stroke-width:1}}.s{{stroke:#7a828c;stroke-dasharray:5 3}}"
      ".w{{stroke:#d55e00;stroke-dasharray:6 3}}.e{{stroke:#0072b2}}"
      "</style>\n<rect class=\"p\" width=\"760\" height=\"436\"/>\n",
      escaped(example_text(example)));
  text += time_panel(40.0, 150.0, "PV and SP, L/min",
                     {{"s", &run.sp}, {"w", &plain.pv}, {"e", &run.pv}}, 0.0, false);
  text += time_panel(216.0, 90.0, "CO, V", {{"w", &plain.co}, {"e", &run.co}}, 0.5, false);
  text += time_panel(332.0, 70.0,
                     controller ? "CO less the model's controller, V"
                                : "residual: PV less the model without it, same CO, L/min",
                     {{"e", &residual}}, 0.2, true);
  text += valve ? phase_panel("flow out of the valve over CO, V",
                              {{{"w", &plain.flow}, &plain.co}, {{"e", &run.flow}, &run.co}})
                : phase_panel("PV over CO, L/min",
                              {{{"w", &plain.pv}, &plain.co}, {{"e", &run.pv}, &run.co}});
  text += fmt::format(
      "<text x=\"{4}\" y=\"430\" text-anchor=\"end\">time, s</text>"
      "<path class=\"e\" d=\"M{1} 332h28\"/><text class=\"t\" x=\"{2}\" y=\"336\">with the effect"
      "</text><path class=\"w\" d=\"M{1} 350h28\"/><text class=\"t\" x=\"{2}\" y=\"354\">without it"
      "</text><path class=\"s\" d=\"M{1} 368h28\"/><text class=\"t\" x=\"{2}\" y=\"372\">set point"
      "</text><text class=\"t\" x=\"{0}\" y=\"18\" font-weight=\"bold\">{3}</text>\n</svg>\n",
      kLeft, kPhaseLeft, kPhaseLeft + 36.0, escaped(example_text(example)), kLeft + kTimeWidth);
  return text;
}

}  // namespace loopwarden::workbench
