// SPDX-License-Identifier: Apache-2.0
#include "model/gap/controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <optional>

#include "model/gap/constants.hpp"
#include "model/gap/record_check.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/subplex.hpp"
#include "model/numeric/two_columns.hpp"

namespace loopwarden::gap {
namespace {

// Where SP, PV and CO are known; a gap of up to three samples is bridged by the value before.
std::vector<SampleRange> known_stretches(const LoopRecord& record) {
  constexpr std::size_t kBridged = 3;
  std::vector<SampleRange> stretches;
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
};

constexpr double kNearLimit = 0.005;  // of the output's span

bool is_inside(double u, const control::PidSettings& settings, double margin) {
  return u > settings.output_low + margin && u < settings.output_high - margin;
}

// The controller beside the record: replayed with any settings, and what the moves of CO say of
// them.
class Replay {
 public:
  // What the controller may do to PV and the error before its law.
  struct Inlet {
    double filter_s = 0.0;   // s
    double dead_band = 0.0;  // PV units
  };

  explicit Replay(const LoopRecord& record) : Replay(record, {}) {}
  Replay(const LoopRecord& record, const Inlet& inlet)
      : record_(record),
        sp_(held(record.sp)),
        pv_(held(record.pv)),
        co_(held(record.co)),
        stretches_(known_stretches(record)),
        training_end_(training_samples(record.size())) {
    const double keep = inlet.filter_s > 0.0 ? std::exp(-record.period_s / inlet.filter_s) : 0.0;
    double filtered = pv_.empty() ? 0.0 : pv_.front();
    for (std::size_t k = 0; k < pv_.size(); ++k) {
      filtered = keep * filtered + (1.0 - keep) * pv_[k];
      pv_[k] = filtered;
      const double error = sp_[k] - filtered;
      pv_[k] += std::clamp(error, -inlet.dead_band, inlet.dead_band);
    }
  }

  bool possible() const noexcept { return !stretches_.empty(); }
  const std::vector<double>& measured() const noexcept { return co_; }

  // The first output's own rounding and the noise in it are not the controller's: the start is free
  // within what one sample can tell. After a gap nobody knows what the controller did meanwhile: it
  // starts anew.
  std::vector<double> run(const control::PidSettings& settings) const {
    std::vector<double> out = co_;
    const double margin = kNearLimit * settings.output_span();
    for (SampleRange stretch : stretches_) {
      // At a limit CO does not show the integral.
      while (stretch.begin < stretch.end && !is_inside(co_[stretch.begin], settings, margin)) {
        ++stretch.begin;
      }
      if (stretch.begin == stretch.end) continue;
      const auto begin = static_cast<std::ptrdiff_t>(stretch.begin);
      const auto part = [&](const std::vector<double>& column) {
        return std::vector<double>(column.begin() + begin,
                                   column.begin() + static_cast<std::ptrdiff_t>(stretch.end));
      };
      const std::vector<double> measured = part(co_);
      const std::size_t head = std::min<std::size_t>(measured.size(), 100);
      double start = measured[0];
      double best = std::numeric_limits<double>::infinity();
      for (int round = 0; round < 2; ++round) {
        const std::vector<double> tried =
            replay_controller(settings, record_.period_s, part(sp_), part(pv_), start);
        double bias = 0.0;
        for (std::size_t k = 0; k < head; ++k) {
          bias += (measured[k] - tried[k]) / static_cast<double>(head);
        }
        const double rms = numeric::rms_apart(tried, measured);
        if (rms < best) {
          best = rms;
          std::copy(tried.begin(), tried.end(), out.begin() + begin);
        }
        if (std::abs(bias) > 0.01 * settings.output_span()) break;
        start = measured[0] + bias;
      }
    }
    return out;
  }

  // CO units, of an output from the measured one: over the whole record, its first two thirds, and
  // the others.
  double apart(std::span<const double> output) const {
    return numeric::rms_apart(output, record_.co);
  }
  double apart_in_proof(std::span<const double> output) const {
    return numeric::rms_apart(output.subspan(training_end_),
                              std::span(record_.co).subspan(training_end_));
  }
  double apart_in_training(std::span<const double> output) const {
    return numeric::rms_apart(output.first(training_end_), record_.co);
  }

  // Kp and Ki from the moves of CO away from its limits.
  std::optional<Slopes> from_moves(const control::PidSettings& settings) const {
    const double margin = kNearLimit * settings.output_span();
    const double side = settings.action == control::Action::reverse ? 1.0 : -1.0;
    const auto inside = [&](double u) { return is_inside(u, settings, margin); };
    numeric::TwoColumns sums;
    for (const SampleRange& stretch : stretches_) {
      for (std::size_t k = stretch.begin + 1; k < std::min(stretch.end, training_end_); ++k) {
        if (!inside(co_[k]) || !inside(co_[k - 1])) continue;
        const double e = side * (sp_[k] - pv_[k]);
        sums.add(e - side * (sp_[k - 1] - pv_[k - 1]), record_.period_s * e, co_[k] - co_[k - 1]);
      }
    }
    if (sums.count < 30 || sums.depends(1e-12)) return std::nullopt;
    const double left = sums.left() / static_cast<double>(sums.count);
    return Slopes{sums.p(), sums.q(), std::sqrt(left * sums.bb / sums.determinant()),
                  std::sqrt(left * sums.aa / sums.determinant())};
  }

 private:
  const LoopRecord& record_;
  std::vector<double> sp_, pv_, co_;  // gaps closed
  std::vector<SampleRange> stretches_;
  std::size_t training_end_;
};

// The anti-windup that explains what the model's own does not; empty where none does.
std::string other_anti_windup(const Replay& replay, const control::PidSettings& settings,
                              double least) {
  for (const auto& [kind, name] :
       {std::pair{control::AntiWindup::integral_clamp, "integral_clamp"},
        std::pair{control::AntiWindup::back_calculation, "back_calculation"},
        std::pair{control::AntiWindup::conditional, "conditional"}}) {
    if (kind == settings.anti_windup) continue;
    control::PidSettings other = settings;
    other.anti_windup = kind;
    if (replay.apart_in_training(replay.run(other)) < least) return name;
  }
  return "";
}

// Searched as logarithms of their ratios to what the moves say.
control::PidSettings refined(const Replay& replay, const control::PidSettings& settings,
                             const Slopes& slopes) {
  const double least_ki = std::max(slopes.ki, 1e-9);
  const auto at = [&](const std::vector<double>& x) {
    control::PidSettings s = settings;
    s.gains.kp = slopes.kp * std::exp(x[0]);
    s.gains.ki = least_ki * std::exp(x[1]);
    return s;
  };
  std::vector<double> x{0.0, 0.0};
  numeric::subplex(
      x, {0.02, 0.02}, -0.4, 0.4,
      [&](const std::vector<double>& to) { return replay.apart_in_training(replay.run(at(to))); },
      {.most_evaluations = 120, .parameter_change = 1e-5});
  return at(x);
}

struct Settings {
  control::PidSettings pid;
  Slopes slopes;
  Replay::Inlet inlet;
  std::vector<double> output;  // CO units
  double apart = std::numeric_limits<double>::infinity();
};

// The gains that go best with such an inlet; nothing where they are none of a controller.
std::optional<Settings> with_inlet(const LoopRecord& record, const control::PidSettings& settings,
                                   const Replay::Inlet& inlet) {
  const Replay replay(record, inlet);
  const std::optional<Slopes> slopes = replay.from_moves(settings);
  if (!slopes || slopes->kp <= 0.0 || slopes->ki < 0.0) return std::nullopt;
  Settings out{refined(replay, settings, *slopes), *slopes, inlet, {}};
  out.output = replay.run(out.pid);
  out.apart = replay.apart_in_training(out.output);
  return out;
}

// The one filter or dead band that leaves least: places a factor of two apart, then between them.
std::optional<Settings> other_inlet(const LoopRecord& record, const control::PidSettings& settings,
                                    double error_rms) {
  std::optional<Settings> best;
  const auto offer = [&](const Replay::Inlet& inlet) {
    std::optional<Settings> tried = with_inlet(record, settings, inlet);
    if (tried && (!best || tried->apart < best->apart)) best = std::move(tried);
  };
  for (double factor = 1.0; factor <= 128.0; factor *= 2.0) {
    offer({.filter_s = factor * record.period_s});
    offer({.dead_band = error_rms * factor / 64.0});
  }
  for (double by = std::sqrt(2.0); best && by > 1.01; by = std::sqrt(by)) {
    const Replay::Inlet middle = best->inlet;
    offer({middle.filter_s * by, middle.dead_band * by});
    offer({middle.filter_s / by, middle.dead_band / by});
  }
  return best;
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

ControllerFinding compare_controller(const LoopRecord& record, const plant::LoopModel& model) {
  ControllerFinding found;
  if (!record.has_co() || !record.has_sp()) return found;
  const Replay replay(record);
  if (!replay.possible()) return found;
  control::PidSettings settings = model.controller.pid;
  // What the converter rounds away is no windup.
  settings.tolerance = std::max(settings.tolerance, resolution_of(replay.measured()));
  found.compared = true;
  found.before = replay.run(settings);
  found.after = found.before;
  found.before_rmse = replay.apart(found.before);
  found.after_rmse = found.before_rmse;
  found.training_rmse_before = replay.apart_in_training(found.before);
  found.kp = settings.gains.kp;
  found.ki = settings.gains.ki;
  const double least = kLeastControllerRms * settings.output_span();
  if (found.training_rmse_before < least) return found;

  // Another anti-windup first: it shows only near the limits.
  found.anti_windup = other_anti_windup(replay, settings, least);
  if (!found.anti_windup.empty()) return found;

  const std::optional<Slopes> slopes = replay.from_moves(settings);
  found.unexplained = !slopes || slopes->kp <= 0.0 || slopes->ki < 0.0;
  if (found.unexplained) return found;
  Settings other{refined(replay, settings, *slopes), *slopes, {}, {}};
  other.output = replay.run(other.pid);
  other.apart = replay.apart_in_training(other.output);
  if (other.apart > least) {
    double squares = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < record.size(); ++k) {
      const double error = record.sp[k] - record.pv[k];
      if (!std::isfinite(error)) continue;
      squares += error * error;
      ++count;
    }
    std::optional<Settings> inlet =
        other_inlet(record, settings, std::sqrt(squares / static_cast<double>(count)));
    if (inlet && inlet->apart < kInletLeaves * other.apart &&
        inlet->apart < kInletMatters * least) {
      other = std::move(*inlet);
    }
  }
  const double kp = other.pid.gains.kp;
  const double ki = other.pid.gains.ki;
  const std::vector<double>& after = other.output;
  const bool other_settings =
      other.inlet.filter_s > 0.0 || other.inlet.dead_band > 0.0 ||
      std::abs(kp / settings.gains.kp - 1.0) > kSameSettings ||
      std::abs(ki - settings.gains.ki) > kSameSettings * std::max(settings.gains.ki, 1e-12);
  const double proof_before = replay.apart_in_proof(found.before);
  found.mismatch = other_settings && other.apart < kSettingsLeave * found.training_rmse_before &&
                   replay.apart_in_proof(after) < std::max(kSettingsLeave * proof_before, least);
  found.unexplained = !found.mismatch;
  if (found.unexplained) return found;
  found.kp = kp;
  found.ki = ki;
  found.filter_s = other.inlet.filter_s;
  found.dead_band = other.inlet.dead_band;
  found.kp_spread = std::max(other.slopes.kp_spread, 1e-3 * kp);
  found.ki_spread = std::max(other.slopes.ki_spread, 1e-3 * ki);
  found.after = after;
  found.after_rmse = replay.apart(after);
  found.exact = found.after_rmse < least;
  return found;
}

}  // namespace loopwarden::gap
