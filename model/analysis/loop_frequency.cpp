// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/loop_frequency.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

#include "model/effects/catalogue.hpp"

namespace loopwarden::analysis {
namespace {

using Complex = std::complex<double>;
constexpr std::size_t kScan = 4000;

// Returns `phase` without a jump from the phase `before`.
double unwrapped(double phase, double before) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return phase - kTurn * std::round((phase - before) / kTurn);
}

}  // namespace

Complex LinearLoop::controller(double w) const {
  const Complex back = std::polar(1.0, -w * sample_time_s);  // z^-1
  Complex c = gains.kp;
  if (gains.ki > 0.0) c += gains.ki * sample_time_s / (1.0 - back);
  if (gains.kd > 0.0) {
    const double keep = gains.derivative_filter_s > 0.0
                            ? std::exp(-sample_time_s / gains.derivative_filter_s)
                            : 0.0;
    c += gains.kd / sample_time_s * (1.0 - back) * (1.0 - keep) / (1.0 - keep * back);
  }
  return c;
}

Complex LinearLoop::process(double w) const {
  const Complex jw(0.0, w);
  Complex g = gain * std::polar(1.0, -w * dead_time_s);
  if (integrating) g /= jw;
  for (const double lag : lags_s) g /= 1.0 + jw * lag;
  return g * (1.0 - std::polar(1.0, -w * sample_time_s)) / (jw * sample_time_s);
}

LinearLoop linear_loop(const plant::LoopModel& model) {
  LinearLoop loop{.gains = model.controller.pid.gains,
                  .gain = std::abs(model.process.gain),
                  .integrating = model.process.integrating(),
                  .dead_time_s = model.process.dead_time_s,
                  .lags_s = {},
                  .sample_time_s = model.sample_time_s,
                  .left_out = {}};
  if (!loop.integrating) loop.lags_s.push_back(model.process.time_constant_s);
  if (model.process.second_time_constant_s > 0.0) {
    loop.lags_s.push_back(model.process.second_time_constant_s);
  }
  const auto take = [&](const effects::EffectSpec& spec) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info == nullptr || info->linear == nullptr) {
      loop.left_out.push_back(spec.name);
      return;
    }
    const effects::LinearPart part = info->linear(effects::SpecReader(*info, spec));
    loop.gain *= part.gain;
    loop.dead_time_s += part.dead_time_s;
    loop.lags_s.insert(loop.lags_s.end(), part.lags_s.begin(), part.lags_s.end());
  };
  for (const auto* chain : {&model.valve_effects, &model.process_effects,
                            &model.transmitter_effects, &model.disturbances}) {
    std::for_each(chain->begin(), chain->end(), take);
  }
  return loop;
}

std::vector<double> frequencies(const LinearLoop& loop, std::size_t count) {
  const double slowest =
      std::accumulate(loop.lags_s.begin(), loop.lags_s.end(), loop.dead_time_s) +
      (loop.gains.ki > 0.0 ? loop.gains.kp / loop.gains.ki : 0.0) +
      (loop.integrating && loop.gains.kp > 0.0 ? 1.0 / (std::abs(loop.gain) * loop.gains.kp) : 0.0);
  const double first = 1e-3 / std::max(slowest, loop.sample_time_s);
  const double last = 0.999 * std::numbers::pi / loop.sample_time_s;
  std::vector<double> w;
  for (std::size_t i = 0; i < count; ++i) {
    w.push_back(first *
                std::pow(last / first, static_cast<double>(i) / static_cast<double>(count - 1)));
  }
  return w;
}

Margins margins(const LinearLoop& loop) {
  Margins m;
  const std::vector<double> w = frequencies(loop, kScan);
  // Two integrators have a phase of at most -180 deg, so a positive start is shifted down by a
  // turn.
  double phase = std::arg(loop.open_loop(w.front()));
  if (loop.integrating && phase > 0.0) phase -= 2.0 * std::numbers::pi;
  double size = std::abs(loop.open_loop(w.front()));
  for (std::size_t i = 0; i < w.size(); ++i) {
    const Complex l = loop.open_loop(w[i]);
    m.sensitivity = std::max(m.sensitivity, 1.0 / std::abs(1.0 + l));
    if (i == 0) continue;
    const double phase_now = unwrapped(std::arg(l), phase);
    const double size_now = std::abs(l);
    if (!std::isfinite(m.gain_margin) && phase > -std::numbers::pi &&
        phase_now <= -std::numbers::pi) {
      const double part = (phase + std::numbers::pi) / (phase - phase_now);
      m.gain_margin = 1.0 / (size + part * (size_now - size));
    }
    if (size > 1.0 && size_now <= 1.0) {
      const double part = (size - 1.0) / (size - size_now);
      const double there = phase + part * (phase_now - phase);
      m.phase_margin_at = w[i - 1] + part * (w[i] - w[i - 1]);
      m.phase_margin_deg = 180.0 + there * 180.0 / std::numbers::pi;
      m.delay_margin_s = (std::numbers::pi + there) / m.phase_margin_at;
    }
    phase = phase_now;
    size = size_now;
  }
  m.stable = m.gain_margin > 1.0 && m.phase_margin_deg > 0.0;
  return m;
}

}  // namespace loopwarden::analysis
