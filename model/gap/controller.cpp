// SPDX-License-Identifier: Apache-2.0
#include "model/gap/controller.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "model/gap/constants.hpp"
#include "model/gap/record_check.hpp"
#include "model/numeric/subplex.hpp"

namespace loopwarden::gap {
namespace {

double rms_difference(const std::vector<double>& a, const std::vector<double>& b, std::size_t end) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < end; ++k) {
    if (!std::isfinite(b[k])) continue;
    sum += (a[k] - b[k]) * (a[k] - b[k]);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

struct Stretch {
  std::size_t begin, end;
};

// Where SP, PV and CO are known; a gap of up to three samples is bridged by the value before.
std::vector<Stretch> known_stretches(const Record& record) {
  constexpr std::size_t kBridged = 3;
  std::vector<Stretch> stretches;
  std::size_t missing = kBridged + 1;  // in a row; so many before the record
  for (std::size_t k = 0; k < record.size(); ++k) {
    const bool known =
        std::isfinite(record.sp[k]) && std::isfinite(record.pv[k]) && std::isfinite(record.co[k]);
    if (!known) {
      ++missing;
      continue;
    }
    if (missing > kBridged) stretches.push_back({k, k});
    stretches.back().end = k + 1;
    missing = 0;
  }
  return stretches;
}

struct Slopes {
  double kp, ki, kp_spread, ki_spread;
  bool found;
};

// Kp and Ki from the moves of CO away from its limits.
Slopes from_moves(const control::PidSettings& settings, double h, const std::vector<double>& sp,
                  const std::vector<double>& pv, const std::vector<double>& co,
                  const std::vector<Stretch>& stretches, std::size_t end) {
  const double margin = 0.005 * (settings.output_high - settings.output_low);
  const double side = settings.action == control::Action::reverse ? 1.0 : -1.0;
  double aa = 0.0;
  double ab = 0.0;
  double bb = 0.0;
  double ay = 0.0;
  double by = 0.0;
  double yy = 0.0;
  int count = 0;
  const auto inside = [&](double u) {
    return u > settings.output_low + margin && u < settings.output_high - margin;
  };
  for (const Stretch& stretch : stretches) {
    for (std::size_t k = stretch.begin + 1; k < std::min(stretch.end, end); ++k) {
      if (!inside(co[k]) || !inside(co[k - 1])) continue;
      const double e = side * (sp[k] - pv[k]);
      const double a = e - side * (sp[k - 1] - pv[k - 1]);
      const double b = h * e;
      const double y = co[k] - co[k - 1];
      aa += a * a;
      ab += a * b;
      bb += b * b;
      ay += a * y;
      by += b * y;
      yy += y * y;
      ++count;
    }
  }
  const double determinant = aa * bb - ab * ab;
  if (count < 30 || !(determinant > 1e-12 * aa * bb)) return {0, 0, 0, 0, false};
  const double kp = (bb * ay - ab * by) / determinant;
  const double ki = (aa * by - ab * ay) / determinant;
  const double left = std::max(0.0, yy - kp * ay - ki * by) / count;
  return {kp, ki, std::sqrt(left * bb / determinant), std::sqrt(left * aa / determinant), true};
}

}  // namespace

std::vector<double> replay_controller(const control::PidSettings& settings, double period_s,
                                      const std::vector<double>& sp, const std::vector<double>& pv,
                                      double first_output) {
  control::Pid pid(settings, period_s);
  // `initialise` means the output of one period ago: take this period's integral action back.
  double went_out = first_output - pid.integral_rate(pid.error(sp[0], pv[0])) * period_s;
  pid.initialise(went_out, sp[0], pv[0]);
  std::vector<double> co(sp.size());
  for (std::size_t k = 0; k < sp.size(); ++k) {
    const double u = pid.step(sp[k], pv[k], went_out, 0.0);
    went_out = std::clamp(u, settings.output_low, settings.output_high);
    co[k] = went_out;
  }
  return co;
}

ControllerFinding compare_controller(const Record& record, const plant::LoopModel& model) {
  ControllerFinding found;
  if (!record.has_co() || !record.has_sp()) return found;
  const std::size_t n = record.size();
  const std::size_t end = training_samples(n);
  const std::vector<double> sp = held(record.sp);
  const std::vector<double> pv = held(record.pv);
  const std::vector<double> co = held(record.co);
  control::PidSettings settings = model.controller.pid;
  // What the converter rounds away is no windup.
  settings.tolerance = std::max(settings.tolerance, resolution_of(co));
  const double span = settings.output_high - settings.output_low;
  const std::vector<Stretch> stretches = known_stretches(record);
  if (stretches.empty()) return found;
  found.compared = true;

  // The first output's own rounding and the noise in it are not the controller's: the start is free
  // within what one sample can tell. Behind a gap nobody knows what the controller did meanwhile: it
  // starts anew.
  const auto replay = [&](const control::PidSettings& s) {
    std::vector<double> out = co;
    for (const Stretch& stretch : stretches) {
      const auto part = [&](const std::vector<double>& column) {
        return std::vector<double>(column.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
                                   column.begin() + static_cast<std::ptrdiff_t>(stretch.end));
      };
      const std::vector<double> measured = part(co);
      const std::size_t head = std::min<std::size_t>(measured.size(), 100);
      double start = measured[0];
      double best = std::numeric_limits<double>::infinity();
      for (int round = 0; round < 2; ++round) {
        const std::vector<double> tried =
            replay_controller(s, record.period_s, part(sp), part(pv), start);
        double bias = 0.0;
        for (std::size_t k = 0; k < head; ++k) {
          bias += (measured[k] - tried[k]) / static_cast<double>(head);
        }
        const double rms = rms_difference(tried, measured, measured.size());
        if (rms < best) {
          best = rms;
          std::copy(tried.begin(), tried.end(),
                    out.begin() + static_cast<std::ptrdiff_t>(stretch.begin));
        }
        if (std::abs(bias) > 0.01 * span) break;
        start = measured[0] + bias;
      }
    }
    return out;
  };
  found.before = replay(settings);
  found.after = found.before;
  found.before_rmse = rms_difference(found.before, record.co, n);
  found.after_rmse = found.before_rmse;
  found.training_rmse_before = rms_difference(found.before, record.co, end);
  found.kp = settings.gains.kp;
  found.ki = settings.gains.ki;

  const double least = kLeastControllerRms * span;
  if (found.training_rmse_before < least) return found;

  // Another anti-windup first: it shows only near the limits.
  for (const auto& [kind, name] :
       {std::pair{control::AntiWindup::integral_clamp, "integral_clamp"},
        std::pair{control::AntiWindup::back_calculation, "back_calculation"},
        std::pair{control::AntiWindup::conditional, "conditional"}}) {
    if (kind == settings.anti_windup) continue;
    control::PidSettings other = settings;
    other.anti_windup = kind;
    if (rms_difference(replay(other), record.co, end) < least) {
      found.anti_windup = name;
      return found;
    }
  }
  const Slopes slopes = from_moves(settings, record.period_s, sp, pv, co, stretches, end);
  if (!slopes.found || slopes.kp <= 0.0 || slopes.ki < 0.0) {
    found.unexplained = true;
    return found;
  }
  const auto with = [&](double kp, double ki) {
    control::PidSettings s = settings;
    s.gains.kp = kp;
    s.gains.ki = ki;
    return s;
  };
  // Searched as logarithms of their ratios to what the moves say.
  const double least_ki = std::max(slopes.ki, 1e-9);
  std::vector<double> x{0.0, 0.0};
  numeric::subplex(x, {0.02, 0.02}, -0.4, 0.4,
                   [&](const std::vector<double>& at) {
                     return rms_difference(
                         replay(with(slopes.kp * std::exp(at[0]), least_ki * std::exp(at[1]))),
                         record.co, end);
                   },
                   {.most_evaluations = 120, .parameter_change = 1e-5});
  const double kp = slopes.kp * std::exp(x[0]);
  const double ki = least_ki * std::exp(x[1]);
  const std::vector<double> after = replay(with(kp, ki));
  const double after_rms = rms_difference(after, record.co, end);
  const bool other_settings =
      std::abs(kp / settings.gains.kp - 1.0) > kSameSettings ||
      std::abs(ki - settings.gains.ki) > kSameSettings * std::max(settings.gains.ki, 1e-12);
  if (other_settings && after_rms < kSettingsLeave * found.training_rmse_before) {
    found.mismatch = true;
    found.kp = kp;
    found.ki = ki;
    found.kp_spread = std::max(slopes.kp_spread, 1e-3 * kp);
    found.ki_spread = std::max(slopes.ki_spread, 1e-3 * ki);
    found.after = after;
    found.after_rmse = rms_difference(after, record.co, n);
  } else {
    found.unexplained = true;
  }
  return found;
}

}  // namespace loopwarden::gap
