// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "model/numeric/random.hpp"
#include "model/specialist/train/team_training.hpp"

namespace loopwarden::tests {

// A loop like the thesis's plant 1, 0 to 10 for both CO and PV.
inline plant::LoopModel flow_loop() {
  plant::LoopModel m;
  m.sample_time_s = 0.1;
  m.controller.pid.gains = {.kp = 0.4, .ki = 0.045, .kd = 0.0};
  m.controller.pid.output_low = 0.0;
  m.controller.pid.output_high = 10.0;
  m.controller.output = {.low = 0.0, .high = 10.0};
  m.controller.set_point = {.low = 0.0, .high = 10.0};
  m.process = {.gain = 1.2, .time_constant_s = 1.7, .dead_time_s = 2.6};
  m.transmitter = {.low = 0.0, .high = 10.0, .resolution = 0.0, .noise = 0.0};
  return m;
}

// Fits that every condition explains down to twice the noise, with movement.
inline specialist::WindowFits plain_fits() {
  specialist::WindowFits f;
  f.usable = true;
  f.noise = 0.1;
  f.co_range = 10.0;
  f.pv_range = 10.0;
  f.co_travel = 30.0;
  f.co_fastest = 1.0;
  for (specialist::FaultFit& fit : f.fits) {
    fit.mse = 0.02;
    fit.innovation = 0.02;
    fit.size = 6.0;
    fit.shape = 0.5;
  }
  return f;
}

inline specialist::ParallelFor one_thread() {
  return [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = 0; i < count; ++i) body(i);
  };
}
// The same work in reverse order, as another thread might do it.
inline specialist::ParallelFor backwards() {
  return [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = count; i-- > 0;) body(i);
  };
}

// CO up and down in slow ramps through a play of `deadband` and a lag with dead time. Code other
// than the fitter's simulates it: sample by sample, in CO units, from the middle of the play.
struct PlayWindow {
  std::vector<double> pv, co;
  numeric::LoopView view() const { return {.pv = pv, .co = co}; }
};
inline PlayWindow play_window(double deadband, double noise, double co_scale = 1.0,
                              double co_zero = 0.0, double pv_scale = 1.0) {
  constexpr double kPi = 3.14159265358979323846;
  numeric::Random random(3);
  PlayWindow w;
  std::vector<double> past;
  double x = 5.0;
  double y = 1.2 * x;
  for (int k = -400; k < 961; ++k) {
    const double u = 5.0 + 1.6 * std::sin(2.0 * kPi * k / 370.0) + 0.5 * std::sin(k / 23.0);
    x = std::min(std::max(x, u - deadband / 2.0), u + deadband / 2.0);
    past.push_back(x);
    const double delayed = past.size() > 26 ? past[past.size() - 27] : past.front();
    if (k >= 0) {
      w.co.push_back(co_zero + co_scale * u);
      w.pv.push_back(pv_scale * (y + noise * random.normal()));
    }
    y += (1.0 - std::exp(-0.1 / 1.7)) * (1.2 * delayed - y);
  }
  return w;
}

}  // namespace loopwarden::tests
