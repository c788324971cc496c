// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/loop_draw.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "model/numeric/draw.hpp"

namespace loopwarden::lab {
namespace {

using numeric::chance;
using numeric::log_uniform;
using numeric::Random;

std::complex<double> loop_gain(const ProcessDraw& p, const ControllerDraw& c, double interval,
                               double w) {
  const std::complex<double> s(0.0, w);
  const std::complex<double> lag =
      p.integrating ? s * (p.tau2 * s + 1.0) : (p.tau1 * s + 1.0) * (p.tau2 * s + 1.0);
  const std::complex<double> process =
      p.gain * std::exp(-s * (p.dead_time + 0.5 * interval)) / lag / (p.filter * s + 1.0);
  return process * c.gain *
         (1.0 + 1.0 / (c.integral_time * s) +
          c.derivative_time * s / (0.1 * c.derivative_time * s + 1.0));
}

// Returns the largest sensitivity 1/|1 + L|; infinite if L encircles -1.
double sensitivity(const ProcessDraw& p, const ControllerDraw& c, double interval) {
  const double scale = p.dead_time + p.tau1 + p.tau2 + c.integral_time + interval;
  double worst = 0.0;
  std::complex<double> before = 0.0;
  for (double w = 1e-3 / scale; w < 300.0 / (p.dead_time + p.tau2 + interval + 0.02 * scale);
       w *= 1.04) {
    const std::complex<double> l = loop_gain(p, c, interval, w);
    worst = std::max(worst, 1.0 / std::abs(1.0 + l));
    // Here a crossing of the negative real axis left of -1, from above to below, is an
    // encirclement.
    if (w > 1e-3 / scale && before.imag() < 0.0 && l.imag() >= 0.0 && l.real() < -1.0) {
      return std::numeric_limits<double>::infinity();
    }
    before = l;
  }
  return worst;
}

}  // namespace

Draw draw_loop(Random& random, const LoopWish& wish) {
  Draw d;
  ProcessDraw& p = d.process;
  p.integrating = wish.integrating;
  p.filter = wish.filter;
  const double dead_share = random.uniform(0.03, 0.75);
  p.dead_time = wish.time_scale * dead_share;
  p.tau1 = wish.time_scale * (1.0 - dead_share);
  p.tau2 = p.tau1 * random.uniform(0.0, 0.6);
  p.gain = log_uniform(random, 0.3, 3.0);
  if (wish.integrating) {
    p.tau2 = p.tau1 * random.uniform(0.1, 1.0);
    p.tau1 = 0.0;
    p.gain = log_uniform(random, 0.002, 0.2) / wish.time_scale;
  }
  ControllerDraw& c = d.controller;
  const double theta = p.dead_time + 0.5 * p.tau2;
  const double closed = theta * log_uniform(random, 0.6, 6.0);
  if (wish.integrating) {
    c.gain = 1.0 / (p.gain * (closed + theta));
    c.integral_time = 4.0 * (closed + theta) * log_uniform(random, 0.3, 4.0);
  } else {
    c.gain = p.tau1 / (p.gain * (closed + theta));
    c.integral_time = std::min(p.tau1, 4.0 * (closed + theta)) * log_uniform(random, 0.4, 2.0);
    if (wish.weight == Weight::integral) {
      const double weaker = log_uniform(random, 0.1, 0.8);
      c.gain *= weaker;
      c.integral_time *= weaker * log_uniform(random, 0.6, 1.6);
    }
  }
  if (wish.closed_loop > closed && !wish.integrating) {
    const double of_thumb = log_uniform(random, 0.1, 1.5);
    c.gain = of_thumb / p.gain;
    c.integral_time = of_thumb * wish.closed_loop;
  }
  if (wish.weight == Weight::proportional) c.integral_time *= log_uniform(random, 3.0, 30.0);
  if (wish.weight == Weight::averaging) {
    c.gain = log_uniform(random, 0.5, 3.0);
    c.integral_time = 4.0 / (c.gain * p.gain) * log_uniform(random, 1.0, 10.0);
  }
  if (chance(random, 0.12)) c.derivative_time = 0.2 * c.integral_time * random.uniform();
  const auto at = [&](double factor, bool by_gain) {
    ControllerDraw changed = c;
    if (by_gain) {
      changed.gain *= factor;
    } else {
      changed.integral_time /= factor;
      changed.gain *= wish.integrating ? 1.0 / std::sqrt(factor) : 1.0;
    }
    return changed;
  };
  const double wanted = wish.tight ? log_uniform(random, 8.0, 60.0) : random.uniform(1.15, 2.5);
  const bool by_gain = wish.tight ? chance(random, 0.5) : true;
  // Raises gain or integral action up to the requested sensitivity if tight. Otherwise lowers the
  // gain if the draw has less margin than requested.
  double factor = 1.0;
  if (wish.tight) {
    double low = 1.0;
    double high = 1.0;
    while (sensitivity(p, at(high, by_gain), wish.interval) < wanted && high < 1e4) high *= 1.5;
    low = high / 1.5;
    for (int i = 0; i < 20; ++i) {
      const double middle = std::sqrt(low * high);
      (sensitivity(p, at(middle, by_gain), wish.interval) < wanted ? low : high) = middle;
    }
    factor = low;
  } else {
    while (sensitivity(p, at(factor, by_gain), wish.interval) > wanted && factor > 1e-4)
      factor *= 0.85;
  }
  c = at(factor, by_gain);
  return d;
}

}  // namespace loopwarden::lab
