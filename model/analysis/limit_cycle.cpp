// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/limit_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/analysis/describing_function.hpp"
#include "model/effects/catalogue.hpp"

namespace loopwarden::analysis {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kFrequencies = 1500;
constexpr std::size_t kAmplitudes = 400;
constexpr double kLargest = 200.0;  // times the least amplitude
// The smallest relative excess of the amplitude over the least amplitude. With a small slip jump a
// cycle can be this near.
constexpr double kNearest = 1e-8;
// At this excess, rounding causes a relative error of 1e-8.
constexpr double kConverged = 1e-7;
constexpr int kNewtonSteps = 60;

double cross(Complex a, Complex b) { return a.real() * b.imag() - a.imag() * b.real(); }

// Returns whether the line segments from a to b and from c to d intersect.
bool meet(Complex a, Complex b, Complex c, Complex d) {
  const double determinant = cross(b - a, d - c);
  if (determinant == 0.0) return false;
  const double along = cross(c - a, d - c) / determinant;
  const double across = cross(c - a, b - a) / determinant;
  return along >= 0.0 && along <= 1.0 && across >= 0.0 && across <= 1.0;
}

Complex critical(const ValveNonlinearity& valve, double amplitude) {
  return -1.0 / valve.describing_function(amplitude);
}

// Refines an intersection of two segments by Newton's method. The unknowns are the logarithms of w
// and of the excess of the amplitude, because -1/N begins as a square root of the excess. Returns
// an empty result if the iteration diverges.
std::optional<LimitCycle> refined(const LinearLoop& loop, const ValveNonlinearity& valve, double w,
                                  double a) {
  constexpr double kStep = 1e-6;
  constexpr double kExcessStep = 1e-3;  // larger, for the same reason
  const double least = valve.least_amplitude();
  double excess = a / least - 1.0;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Complex l = loop.open_loop(w);
    a = least * (1.0 + excess);
    const Complex c = critical(valve, a);
    const Complex dl = (loop.open_loop(w * (1.0 + kStep)) - l) / kStep;
    const Complex dc =
        (critical(valve, least * (1.0 + excess * (1.0 + kExcessStep))) - c) / kExcessStep;
    const double determinant = cross(dl, -dc);
    if (determinant == 0.0) return std::nullopt;
    const double to_w = cross(c - l, -dc) / determinant;
    const double to_a = cross(dl, c - l) / determinant;
    w *= std::exp(std::clamp(to_w, -0.1, 0.1));
    excess = std::max(excess * std::exp(std::clamp(to_a, -1.0, 1.0)), 0.01 * kNearest);
    if (std::abs(to_w) + std::abs(to_a) > kConverged) continue;
    return LimitCycle{
        .co_amplitude = a,
        .pv_amplitude = a * std::abs(valve.describing_function(a)) * std::abs(loop.process(w)),
        .period_s = 2.0 * std::numbers::pi / w,
        .stable = cross(dl, dc) > 0.0};
  }
  return std::nullopt;
}

}  // namespace

Complex ValveNonlinearity::describing_function(double amplitude) const {
  return backlash ? backlash_describing_function(s, amplitude)
                  : stiction_describing_function(s, j, amplitude);
}

std::optional<ValveNonlinearity> valve_nonlinearity(const plant::LoopModel& model) {
  std::optional<ValveNonlinearity> found;
  const auto take = [&](const effects::EffectSpec& spec) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info == nullptr || info->valve_band == nullptr) return;
    const effects::ValveBand band = info->valve_band(effects::SpecReader(*info, spec));
    found = {band.backlash, band.s, band.j};
  };
  std::for_each(model.valve_effects.begin(), model.valve_effects.end(), take);
  if (!found) {
    for (const plant::ScheduledFault& fault : model.scenario.faults) take(fault.effect);
  }
  return found;
}

bool is_valve_nonlinearity(std::string_view effect) noexcept {
  const effects::Descriptor* info = effects::find_effect(effect);
  return info != nullptr && info->valve_band != nullptr;
}

std::vector<CriticalPoint> critical_locus(const ValveNonlinearity& valve, double times,
                                          std::size_t count) {
  // The points are denser at the beginning: a - a0 grows geometrically.
  std::vector<CriticalPoint> points;
  const double least = valve.least_amplitude();
  for (std::size_t i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(count - 1);
    const double amplitude = least * (1.0 + kNearest * std::pow((times - 1.0) / kNearest, part));
    points.push_back({amplitude, critical(valve, amplitude)});
  }
  return points;
}

AxisReach axis_reach(const LinearLoop& loop, const ValveNonlinearity& valve) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  AxisReach reach{.loop = kInfinite, .valve = kInfinite};
  if (!valve.backlash && valve.j > 0.0) {
    reach.valve = std::numbers::pi / 4.0 * valve.s / valve.j;
  }
  const std::vector<double> w = frequencies(loop, kFrequencies);
  Complex before = loop.open_loop(w.front());
  if (before.real() < 0.0) return reach;
  for (const double one : w) {
    const Complex l = loop.open_loop(one);
    if (l.real() < 0.0) {
      const double part = before.real() / (before.real() - l.real());
      reach.loop = std::abs(before + part * (l - before));
      return reach;
    }
    before = l;
  }
  reach.loop = 0.0;
  return reach;
}

std::vector<LimitCycle> limit_cycles(const LinearLoop& loop, const ValveNonlinearity& valve) {
  std::vector<LimitCycle> cycles;
  if (!(valve.s > 0.0)) return cycles;
  const std::vector<double> w = frequencies(loop, kFrequencies);
  std::vector<Complex> nyquist;
  nyquist.reserve(w.size());
  for (const double one : w) nyquist.push_back(loop.open_loop(one));
  const std::vector<CriticalPoint> locus = critical_locus(valve, kLargest, kAmplitudes);
  for (std::size_t i = 0; i + 1 < w.size(); ++i) {
    for (std::size_t k = 0; k + 1 < locus.size(); ++k) {
      if (!meet(nyquist[i], nyquist[i + 1], locus[k].value, locus[k + 1].value)) continue;
      const std::optional<LimitCycle> cycle =
          refined(loop, valve, std::sqrt(w[i] * w[i + 1]), locus[k].amplitude);
      if (!cycle) continue;
      const bool known = std::any_of(cycles.begin(), cycles.end(), [&](const LimitCycle& other) {
        return std::abs(other.co_amplitude / cycle->co_amplitude - 1.0) < 1e-6 &&
               std::abs(other.period_s / cycle->period_s - 1.0) < 1e-6;
      });
      if (!known) cycles.push_back(*cycle);
    }
  }
  std::sort(cycles.begin(), cycles.end(), [](const LimitCycle& a, const LimitCycle& b) {
    return a.co_amplitude < b.co_amplitude;
  });
  return cycles;
}

}  // namespace loopwarden::analysis
