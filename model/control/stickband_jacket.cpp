// SPDX-License-Identifier: Apache-2.0
#include "model/control/stickband_jacket.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {
namespace {
constexpr double kLeastShare = 0.05;  // of Ki e that the dwell form leaves to the integrator
}  // namespace

StickbandJacket::StickbandJacket(const JacketSettings& settings, double period_s) noexcept
    : settings_(settings), period_s_(period_s) {}

void StickbandJacket::configure(const JacketSettings& settings) noexcept {
  const bool same_law = settings.form == settings_.form;
  settings_ = settings;
  if (!same_law) reset();
}

void StickbandJacket::reset() noexcept {
  mean_error_ = 0.0;
  standing_back_ = false;
  stem_ = {};
}

void StickbandJacket::watch_mean_error(double error) noexcept {
  const double weight = std::min(1.0, period_s_ / settings_.mean_error_time_s);
  mean_error_ += weight * (error - mean_error_);
  const double limit = settings_.max_mean_error;
  standing_back_ = std::abs(mean_error_) > (standing_back_ ? limit / 2.0 : limit);
}

void StickbandJacket::watch_stem(const JacketInputs& in) noexcept {
  const double stem_moved = in.valve_position - stem_.position;
  if (!stem_.known || std::abs(stem_moved) > settings_.dead_zone) {
    const double slip_error = stem_.was_stuck ? stem_.error : stem_.slip_error;
    stem_ = {.known = true,
             .position = in.valve_position,
             .output = in.output,
             .slip_error = slip_error};
    return;
  }
  // The output itself must have moved: a valve that is only slow catches up with one at rest.
  const double output_moved = in.output - stem_.output;
  stem_.stuck = std::abs(output_moved) > settings_.dead_zone &&
                std::abs(output_moved - stem_moved) > settings_.dead_zone;
  stem_.was_stuck = stem_.was_stuck || stem_.stuck;
  stem_.error = in.error;
  // Kept once it is so: noise that swings a small error through zero must not be integrated at two
  // speeds, which would balance at an error.
  stem_.crossed = stem_.crossed || in.error * stem_.slip_error < 0.0;
}

double StickbandJacket::bounded_rate(const JacketInputs& in) const noexcept {
  const double d = in.output - in.valve_position;
  const double beyond = d - std::clamp(d, -settings_.dead_zone, settings_.dead_zone);
  const double authority = std::abs(in.integral_rate) / 2.0;
  return -std::clamp(settings_.gain_per_s * beyond, -authority, authority);
}

double StickbandJacket::dwell_rate(const JacketInputs& in) const noexcept {
  if (!stem_.stuck || !stem_.crossed) return 0.0;
  const double ratio = std::abs(in.error / stem_.slip_error);
  const double share = std::clamp(5.0 * ratio - 2.5, kLeastShare, 1.0);
  return -(1.0 - share) * in.integral_rate;
}

double StickbandJacket::step(const JacketInputs& in) noexcept {
  if (settings_.form == JacketForm::off) return 0.0;
  if (!std::isfinite(in.error) || !std::isfinite(in.integral_rate)) return 0.0;

  const bool trusted = in.valve_position_valid && std::isfinite(in.output - in.valve_position);
  if (settings_.form == JacketForm::paper) {
    return trusted ? -settings_.gain_per_s * (in.output - in.valve_position) : 0.0;
  }
  watch_mean_error(in.error);
  if (!trusted) {
    stem_ = {};
    return 0.0;
  }
  watch_stem(in);
  if (standing_back_) return 0.0;
  return settings_.form == JacketForm::bounded ? bounded_rate(in) : dwell_rate(in);
}

}  // namespace loopwarden::control
