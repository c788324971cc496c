// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/valve_test.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "model/analysis/limits.hpp"
#include "model/analysis/step_metrics.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::analysis {
namespace {

double middle_of(const ValveTestSettings& s) { return (s.low + s.high) / 2.0; }

std::vector<Hold> study_plan(const ValveTestSettings& s) {
  const double at = middle_of(s);
  std::vector<Hold> holds;
  for (const double percent : Limits::kStudySizes) {
    const double size = percent / 100.0 * s.span;
    const double before = std::max(s.low, at - 0.05 * s.span);
    // Up to the middle from below, further up by the size, then back by the size.
    holds.insert(holds.end(), {{before, s.hold_s},
                               {at, s.hold_s},
                               {std::min(s.high, at + size), s.hold_s},
                               {at, s.hold_s}});
  }
  return holds;
}

std::vector<Hold> ramp_plan(const ValveTestSettings& s, int points, double seconds) {
  std::vector<Hold> holds;
  for (int i = 0; i < 2 * points - 1; ++i) {
    const int step = i < points ? i : 2 * points - 2 - i;
    holds.push_back({s.low + (s.high - s.low) * step / (points - 1), seconds});
  }
  return holds;
}

std::vector<Hold> sine_plan(const ValveTestSettings& s) {
  std::vector<Hold> holds;
  const double amplitude = std::min((s.high - s.low) / 2.0, 0.1 * s.span);
  for (const double period_s : Limits::kSinePeriods_s) {
    const auto samples =
        static_cast<int>(std::lround(Limits::kSineCycles * period_s / s.sample_time_s));
    for (int k = 0; k < samples; ++k) {
      const double angle = 2.0 * std::numbers::pi * k * s.sample_time_s / period_s;
      holds.push_back({middle_of(s) + amplitude * std::sin(angle), s.sample_time_s});
    }
  }
  return holds;
}

double settled(const HeldPosition& hold) {
  const std::size_t n = hold.position.size();
  if (n == 0) return std::nan("");
  return numeric::mean(std::span(hold.position).last(std::max<std::size_t>(1, n / 3)));
}

void add_step(ValveFigures& out, const std::string& name, const HeldPosition& before,
              const HeldPosition& after, double period_s, double moved) {
  const double from = settled(before);
  const double to = settled(after);
  if (!(std::abs(to - from) > moved)) {
    out[name + "_travel"] = 0.0;
    return;
  }
  const auto reach = [&](double share) {
    for (std::size_t k = 0; k < after.position.size(); ++k) {
      if ((after.position[k] - from) / (to - from) >= share)
        return static_cast<double>(k) * period_s;
    }
    return std::numeric_limits<double>::infinity();
  };
  out[name + "_travel"] = to - from;
  out[name + "_dead_time_s"] = reach(0.05);
  out[name + "_t63_s"] = reach(0.632);
  out[name + "_t86_s"] = reach(0.865);
  out[name + "_overshoot_percent"] =
      100.0 * step_metrics(after.position, from, to, period_s).overshoot;
}

ValveFigures study_figures(std::span<const HeldPosition> holds, double span, double moved) {
  ValveFigures out;
  out["resolution_percent"] = std::numeric_limits<double>::infinity();
  out["dead_band_percent"] = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; 4 * i + 3 < holds.size() && i < Limits::kStudySizes.size(); ++i) {
    const double at = settled(holds[4 * i + 1]);
    const double onwards = settled(holds[4 * i + 2]);
    const double back = settled(holds[4 * i + 3]);
    const double size = 100.0 * (holds[4 * i + 2].output - holds[4 * i + 1].output) / span;
    if (onwards - at > moved) {
      out["resolution_percent"] = std::min(out["resolution_percent"], size);
    }
    if (onwards - back > moved) out["dead_band_percent"] = std::min(out["dead_band_percent"], size);
  }
  return out;
}

// Returns the figures of a scan from its branches, the positions at each output on the way up and
// down.
ValveFigures scan_figures(std::span<const HeldPosition> holds, double span) {
  ValveFigures out;
  const std::size_t points = (holds.size() + 1) / 2;
  if (points < 3) return out;
  std::vector<double> gaps;
  double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
  std::vector<std::pair<double, double>> mean;
  double greatest = 0.0;
  for (std::size_t i = 0; i < points; ++i) {
    const double up = settled(holds[i]);
    const double down = settled(holds[holds.size() - 1 - i]);
    const double x = holds[i].output;
    const double y = (up + down) / 2.0;
    mean.emplace_back(x, y);
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
    greatest = std::max(greatest, std::abs(down - up));
    // The ends belong to both branches.
    if (i > 0 && i + 1 < points) gaps.push_back(down - up);
  }
  const auto n = static_cast<double>(points);
  const double slope = (sum_xy - sum_x * sum_y / n) / (sum_xx - sum_x * sum_x / n);
  double off = 0.0;
  for (const auto& [x, y] : mean) {
    off = std::max(off, std::abs(y - (sum_y / n + slope * (x - sum_x / n))));
  }
  out["hysteresis_and_dead_band_percent"] = 100.0 * greatest / span;
  out["dead_band_percent"] =
      slope > 0.0 ? 100.0 * std::abs(numeric::quantile_in_place(gaps, 0.5)) / slope / span : 0.0;
  out["slope"] = slope;
  out["linearity_percent"] = 100.0 * off / span;
  return out;
}

ValveFigures ramp_figures(std::span<const HeldPosition> holds, double span, double moved) {
  ValveFigures out;
  double answered = 0.0;
  double steps = 0.0;
  double lag = 0.0;
  for (std::size_t i = 1; i < holds.size(); ++i) {
    if (holds[i].output == holds[i - 1].output) continue;
    steps += 1.0;
    const double move = settled(holds[i]) - settled(holds[i - 1]);
    answered += move * (holds[i].output - holds[i - 1].output) > 0.0 && std::abs(move) > moved;
    lag = std::max(lag, std::abs(settled(holds[i]) - holds[i].output));
  }
  out["answered_percent"] = steps > 0.0 ? 100.0 * answered / steps : 0.0;
  out["worst_lag_percent"] = 100.0 * lag / span;
  return out;
}

ValveFigures sine_figures(const ValveTestSettings& s, std::span<const HeldPosition> holds) {
  ValveFigures out;
  std::size_t at = 0;
  for (const double period_s : Limits::kSinePeriods_s) {
    const auto cycle = static_cast<std::size_t>(std::lround(period_s / s.sample_time_s));
    const std::size_t whole = cycle * Limits::kSineCycles;
    if (at + whole > holds.size()) break;
    std::complex<double> in = 0.0, answer = 0.0;
    for (std::size_t k = whole - 2 * cycle; k < whole; ++k) {  // the first cycle settles
      const std::complex<double> turn = std::polar(
          1.0, -2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(cycle));
      in += holds[at + k].output * turn;
      answer += settled(holds[at + k]) * turn;
    }
    const std::complex<double> ratio = answer / in;
    const std::string name = std::to_string(static_cast<int>(period_s)) + "_s";
    out["gain_at_" + name] = std::abs(ratio);
    out["phase_deg_at_" + name] = std::arg(ratio) * 180.0 / std::numbers::pi;
    at += whole;
  }
  return out;
}

}  // namespace

const char* to_text(ValveTest test) noexcept {
  return numeric::enum_name<ValveTest::sine>(
      test, {"step_change", "stepped_ramp", "step_study", "static_scan", "dynamic_scan", "sine"});
}

std::vector<Hold> plan(ValveTest test, const ValveTestSettings& s) {
  const double quarter = (s.high - s.low) / 4.0;
  switch (test) {
    case ValveTest::step_change:
      return {{middle_of(s) - quarter, s.hold_s},
              {middle_of(s) + quarter, 2.0 * s.hold_s},
              {middle_of(s) - quarter, 2.0 * s.hold_s}};
    case ValveTest::stepped_ramp: {
      std::vector<Hold> holds;
      const double step = std::min(0.01 * s.span, (s.high - s.low) / Limits::kRampSteps);
      const double from = middle_of(s) - step * Limits::kRampSteps / 2.0;
      for (int i = 0; i <= 2 * Limits::kRampSteps; ++i) {
        holds.push_back(
            {from + step * (i <= Limits::kRampSteps ? i : 2 * Limits::kRampSteps - i), s.hold_s});
      }
      return holds;
    }
    case ValveTest::step_study: return study_plan(s);
    case ValveTest::static_scan: return ramp_plan(s, Limits::kScanPoints, s.hold_s);
    case ValveTest::dynamic_scan: {
      // Each direction takes the time of ten holds, with one point per sample but at most 400
      // points.
      const double each = std::max(s.sample_time_s, 10.0 * s.hold_s / 400.0);
      return ramp_plan(s, static_cast<int>(std::max(3.0, 10.0 * s.hold_s / each)), each);
    }
    case ValveTest::sine: break;
  }
  return sine_plan(s);
}

ValveFigures figures(ValveTest test, const ValveTestSettings& s,
                     std::span<const HeldPosition> holds, double moved) {
  switch (test) {
    case ValveTest::step_change: {
      ValveFigures out;
      if (holds.size() < 3) return out;
      add_step(out, "up", holds[0], holds[1], s.sample_time_s, moved);
      add_step(out, "down", holds[1], holds[2], s.sample_time_s, moved);
      return out;
    }
    case ValveTest::stepped_ramp: return ramp_figures(holds, s.span, moved);
    case ValveTest::step_study: return study_figures(holds, s.span, moved);
    case ValveTest::static_scan:
    case ValveTest::dynamic_scan: return scan_figures(holds, s.span);
    case ValveTest::sine: break;
  }
  return sine_figures(s, holds);
}

}  // namespace loopwarden::analysis
