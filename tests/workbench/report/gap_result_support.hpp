// SPDX-License-Identifier: Apache-2.0
// A hand-written gap result with a value in every field.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

#include "model/gap/result.hpp"

namespace loopwarden::tests {

inline gap::Result complete_gap_result(std::size_t samples = 600) {
  gap::Result result;
  result.outcome = gap::Outcome::missing_effect;
  result.sentence = "The model lacks stiction of 9 % of span, which closes 98 % of the gap.";
  result.model.process = {.gain = 1.2, .time_constant_s = 4.0, .dead_time_s = 1.5};
  result.corrected = result.model;
  result.corrected.process.gain = 1.212;
  const effects::EffectSpec stiction{.name = "stiction", .parameters = {{"s", 0.9}, {"j", 0.3}}};
  result.corrected.valve_effects.push_back(stiction);

  result.check.notes = {{"missing", "2 samples of PV are missing.", 7.0, 7.1},
                        {"quantised", "PV moves in steps of 0.01."}};
  result.check.noise_rms = 0.011;
  result.check.pv_resolution = 0.0025;
  result.check.co_resolution = 0.0024;
  result.check.output_reversals = 41;
  result.check.output_span_used = 5.5;

  result.effects.push_back({.spec = stiction,
                            .block = effects::Block::valve,
                            .confidence = 0.97,
                            .lead_nats = 31.5,
                            .alternatives = {"backlash"},
                            .interval = {{"s", {0.88, 0.95}}, {"j", {0.25, 0.36}}},
                            .evidence = "The stem rests after each of 41 reversals."});
  result.posterior = {{{"stiction"}, 0.97}, {{"backlash"}, 0.02}, {{"unnamed"}, 0.01}};
  result.rest = {.is_noise = false, .closed = 0.98, .quiet_rmse = 0.014};
  result.floor = {.transmitter_rmse = 0.012, .load_rmse = 0.005, .load_tested = true};
  result.load_intensity = 0.004;
  result.before = {0.31, 61.0, 0.30, 0.33, 58.0};
  result.after = {0.02, 97.4, 0.019, 0.021, 97.1};
  result.remainder = gap::Remainder{0.021, 0.03, gap::LooksLike::valve, {"sp", "co"}};
  result.controller_before_rmse = 0.01;
  result.controller_after_rmse = 0.009;
  result.steps = {{"drift", 0.2, 0.4}, {"stiction", 0.018, 0.021}};
  result.located = {{gap::LocatedBy::block, effects::Block::valve, "valve", 0.0, 0.0, 0.8},
                    {gap::LocatedBy::block, effects::Block::process, "process", 0.0, 0.0, 0.2},
                    {gap::LocatedBy::time, effects::Block::valve, "20 to 30 s", 20.0, 30.0, 0.4},
                    {gap::LocatedBy::time, effects::Block::valve, "the rest", 0.0, 60.0, 0.6},
                    {gap::LocatedBy::condition, effects::Block::valve, "after the output reverses",
                     22.0, 25.0, 1.0}};
  result.candidates = {{"backlash",
                        effects::Block::valve,
                        {"backlash", {{"deadband", 1.1}}},
                        0.05,
                        420.0,
                        false,
                        "leaves the jumps"},
                       {"stiction", effects::Block::valve, stiction, 0.018, 900.0, true, ""},
                       {"drift",
                        effects::Block::transmitter,
                        {"drift", {{"rate", 1e-4}}},
                        gap::kNone,
                        gap::kNone,
                        false,
                        "no trend"}};
  result.holdout_from_s = static_cast<double>(samples * 2 / 3) * 0.1;

  gap::Series& s = result.series;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * 0.1;
    const double wave = std::sin(t / 3.0);
    s.time_s.push_back(t);
    s.sp.push_back(t < 15.0 ? 5.0 : 6.0);
    s.pv.push_back(5.0 + wave + 0.01 * std::sin(77.0 * t));
    s.co.push_back(4.0 - wave);
    s.pv_before.push_back(5.0 + 0.5 * wave);
    s.pv_after.push_back(5.0 + 0.99 * wave);
    s.co_before.push_back(4.0 - 0.9 * wave);
    s.co_after.push_back(4.0 - wave);
    s.stem.push_back(4.0 - 0.8 * wave);
  }
  return result;
}

}  // namespace loopwarden::tests
