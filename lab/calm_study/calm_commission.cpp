// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/calm_commission.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/loop_trial.hpp"
#include "model/twin/commission.hpp"
#include "model/twin/explain.hpp"
#include "model/twin/planned_moves_of.hpp"
#include "model/watch/twin_watch.hpp"

namespace loopwarden::lab {
namespace {

constexpr double kHealthy_s = 1200.0;
constexpr double kBefore_s = 900.0;  // of the explained minutes, still healthy
constexpr double kLongest_s = 3600.0;
constexpr double kHealthyPlay = 0.002;  // of the output's span

void in_turn(std::size_t count, const std::function<void(std::size_t)>& f) {
  for (std::size_t i = 0; i < count; ++i) f(i);
}

plant::LoopModel healthy_loop(const StickyLoop& loop) {
  plant::LoopModel model = loop.trial.model;
  const double span = model.controller.pid.output_span();
  model.valve_effects = {{.name = "backlash", .parameters = {{"deadband", kHealthyPlay * span}}}};
  return model;
}

std::optional<plant::LoopModel> twin_of(const StickyLoop& loop, numeric::Random& random) {
  plant::LoopModel model = healthy_loop(loop);
  double at_s = 60.0;
  for (auto& [time_s, set_point] : model.scenario.set_point) {
    time_s = std::exchange(at_s, at_s + 160.0);
  }
  model.scenario.set_point.front().first = 0.0;
  const analysis::SimulatedRecord r = analysis::run_model(model, kHealthy_s);
  plant::LoopModel believed = model;
  believed.disturbances.clear();
  believed.valve_effects.clear();
  for (double* one :
       {&believed.process.gain, &believed.process.time_constant_s, &believed.process.dead_time_s}) {
    *one *= random.uniform(0.7, 1.3);
  }
  const twin::Commissioning done =
      twin::commission({.records = {r}, .model = believed}, in_turn, [](double) {});
  if (done.outcome != twin::Outcome::commissioned) return std::nullopt;
  return done.twin;
}

}  // namespace

std::optional<control::PlannedMovesSettings> found_out(const StickyLoop& loop,
                                                       numeric::Random& random) {
  const std::optional<plant::LoopModel> twin = twin_of(loop, random);
  if (!twin) return std::nullopt;
  std::optional<control::PlannedMovesSettings> settings = twin::planned_moves_of(*twin);
  if (!settings) return std::nullopt;

  plant::LoopModel model = healthy_loop(loop);
  model.scenario.faults = {{.effect = loop.trial.model.valve_effects.front(),
                            .block = effects::Block::valve,
                            .schedule = {.from_s = kBefore_s}}};
  const std::vector<std::pair<double, double>> set_points = model.scenario.set_point;
  model.scenario.set_point.clear();
  for (std::size_t i = 0; i < set_points.size(); ++i) {
    model.scenario.set_point.emplace_back(500.0 * static_cast<double>(i), set_points[i].second);
  }
  model.scenario.seed = random.bits();
  const analysis::SimulatedRecord r = analysis::run_model(model, kLongest_s);
  const auto samples = [&](double s) {
    return static_cast<std::size_t>(std::lround(s / r.period_s));
  };
  watch::TwinWatch watch(*twin);
  std::size_t alarm = 0;
  while (alarm < r.pv.size() && !(watch.on() && alarm > samples(kBefore_s))) {
    watch.add(r.pv[alarm], r.co[alarm]);
    ++alarm;
  }
  const std::size_t last = alarm + samples(twin::kMostSeen_s);
  if (last > r.pv.size()) return std::nullopt;
  const twin::Explanation explanation =
      twin::explain(r.part(0, last), *twin, alarm, {.enough_s = twin::kMostSeen_s}, in_turn);
  if (!explanation.usable()) return std::nullopt;
  const auto& effects = explanation.result.effects;
  const auto effect = std::find_if(effects.begin(), effects.end(),
                                   [](const auto& one) { return one.spec.name == "stiction"; });
  if (effect == effects.end()) return std::nullopt;
  std::vector<std::string> alternatives;
  for (const gap::FoundEffect& one : effects) {
    alternatives.insert(alternatives.end(), one.alternatives.begin(), one.alternatives.end());
  }
  const std::optional<twin::Stick> stick =
      twin::stick_of(effect->spec.parameters, effect->interval, effect->confidence, alternatives);
  if (!stick) return std::nullopt;
  twin::set_stick(*settings, *stick);
  return settings;
}

}  // namespace loopwarden::lab
