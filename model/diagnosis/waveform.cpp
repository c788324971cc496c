// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/waveform.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kMeanCyclePoints = 32;

// Returns the first samples of the half cycles; the last entry is the end of the last one.
std::vector<std::size_t> half_cycles(const Series& smooth, double depth, bool& first_rises) {
  std::vector<std::size_t> starts;
  int side = 0;
  std::size_t crossing = 0;
  for (std::size_t k = 1; k < smooth.size(); ++k) {
    if ((smooth[k - 1] < 0.0) != (smooth[k] < 0.0)) crossing = k;
    const int now = smooth[k] > depth ? 1 : smooth[k] < -depth ? -1 : 0;
    if (now == 0 || now == side) continue;
    if (side != 0) {
      if (starts.empty()) first_rises = now > 0;
      starts.push_back(crossing);
    }
    side = now;
  }
  return starts;
}

double half_sine(double t, double peak) {
  return t < peak ? std::sin(std::numbers::pi * t / (2.0 * peak))
                  : std::sin(std::numbers::pi * (1.0 - t) / (2.0 * (1.0 - peak)));
}
double triangle(double t, double peak) { return t < peak ? t / peak : (1.0 - t) / (1.0 - peak); }
double flat_top(double t, double rise, double fall) {
  return std::min({1.0, rise > 0.0 ? t / rise : 1.0, fall > 0.0 ? (1.0 - t) / fall : 1.0});
}

// Returns the least energy that remains after a multiple of the shape; `shape(t)` at t in (0, 1).
template <class Shape>
double energy_left(std::span<const double> x, Shape shape) {
  double xs = 0.0;
  double ss = 0.0;
  double xx = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double s = shape((static_cast<double>(k) + 0.5) / static_cast<double>(x.size()));
    xs += x[k] * s;
    ss += s * s;
    xx += x[k] * x[k];
  }
  return xx - xs * xs / ss;
}

double interpolated(std::span<const double> x, double at) {
  const double inside = std::clamp(at, 0.0, static_cast<double>(x.size() - 1));
  const auto k = static_cast<std::size_t>(inside);
  const double share = inside - static_cast<double>(k);
  return k + 1 < x.size() ? x[k] + share * (x[k + 1] - x[k]) : x[k];
}

void add_harmonics(Waveform& w, std::span<const double> x, const std::vector<std::size_t>& starts,
                   std::size_t first_rise) {
  std::array<double, kMeanCyclePoints> sum{};
  double energy = 0.0;
  double cycles = 0.0;
  for (std::size_t i = first_rise; i + 2 < starts.size(); i += 2) {
    const double length = static_cast<double>(starts[i + 2] - starts[i]);
    for (std::size_t j = 0; j < sum.size(); ++j) {
      const double at = static_cast<double>(starts[i]) +
                        length * (static_cast<double>(j) + 0.5) / static_cast<double>(sum.size());
      const double value = interpolated(x, at - 0.5);
      sum[j] += value;
      energy += value * value;
    }
    cycles += 1.0;
  }
  if (cycles < 2.0 || energy <= 0.0) return;
  std::array<std::complex<double>, 4> c{};
  double mean_energy = 0.0;
  for (std::size_t j = 0; j < sum.size(); ++j) {
    const double value = sum[j] / cycles;
    mean_energy += value * value;
    for (std::size_t h = 1; h < c.size(); ++h) {
      const double angle = -2.0 * std::numbers::pi * static_cast<double>(h) *
                           static_cast<double>(j) / static_cast<double>(sum.size());
      c[h] += value * std::polar(1.0, angle);
    }
  }
  w.repeats = mean_energy * cycles / energy;
  if (std::abs(c[1]) <= 0.0) return;
  const std::complex<double> direction = c[1] / std::abs(c[1]);
  const std::complex<double> third = c[3] / (direction * direction * direction) / std::abs(c[1]);
  w.third_in_phase = std::clamp(third.real(), -1.0, 1.0);
  w.third_across = std::min(1.0, std::abs(third.imag()));
  w.second = std::min(1.0, std::abs(c[2]) / std::abs(c[1]));
}

}  // namespace

Waveform waveform(std::span<const double> x, double period) {
  constexpr std::array<double, 5> kPeaks{0.2, 0.35, 0.5, 0.65, 0.8};
  constexpr std::array<double, 3> kEdges{0.0, 0.1, 0.2};
  Waveform w;
  const Series smooth = moving_mean(x, static_cast<std::size_t>(period / 12.0));
  bool first_rises = true;
  const std::vector<std::size_t> starts =
      half_cycles(smooth, Limits::kShapeCrossingDepth * numeric::deviation(smooth), first_rises);
  double energy = 0.0;
  double sine = 0.0;
  double straight = 0.0;
  double flat = 0.0;
  double log_areas = 0.0;
  Series values;
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
    const std::size_t length = starts[i + 1] - starts[i];
    if (length < Limits::kLeastInHalfCycle || static_cast<double>(length) < period / 6.0) continue;
    const auto half = x.subspan(starts[i], length);
    double best_sine = 1e300;
    double best_triangle = 1e300;
    double best_flat = 1e300;
    double best_peak = 0.5;
    for (const double peak : kPeaks) {
      best_sine =
          std::min(best_sine, energy_left(half, [&](double t) { return half_sine(t, peak); }));
      const double left = energy_left(half, [&](double t) { return triangle(t, peak); });
      if (left < best_triangle) best_peak = peak;
      best_triangle = std::min(best_triangle, left);
    }
    for (const double rise : kEdges) {
      for (const double fall : kEdges) {
        best_flat = std::min(best_flat,
                             energy_left(half, [&](double t) { return flat_top(t, rise, fall); }));
      }
    }
    for (const double v : half) {
      energy += v * v;
      values.push_back(v);
    }
    sine += best_sine;
    straight += best_triangle;
    flat += best_flat;
    const auto peak_at = static_cast<std::size_t>(best_peak * static_cast<double>(length));
    const double before =
        std::abs(numeric::mean(half.first(peak_at))) * static_cast<double>(peak_at);
    const double after =
        std::abs(numeric::mean(half.subspan(peak_at))) * static_cast<double>(length - peak_at);
    if (before > 0.0 && after > 0.0) {
      log_areas += std::clamp(std::log(before / after), -3.0, 3.0);
    }
    ++w.half_cycles;
  }
  if (w.half_cycles < 4 || energy <= 0.0) return Waveform{};
  w.sine_error = sine / energy;
  w.triangle_error = straight / energy;
  w.flat_error = flat / energy;
  w.area_ratio = std::exp(log_areas / static_cast<double>(w.half_cycles));
  w.kurtosis = numeric::kurtosis(values);
  add_harmonics(w, x, starts, first_rises ? 0 : 1);
  return w;
}

}  // namespace loopwarden::diagnosis
