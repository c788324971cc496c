// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/twin_watch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "model/effects/catalogue.hpp"

namespace loopwarden::monitor {
namespace {

constexpr double kForgets_s = 900.0;  // an offset that nobody modelled
constexpr std::size_t kFewestInBlock = 10;

double load_intensity(const plant::LoopModel& model) {
  for (const plant::EffectSpec& spec : model.disturbances) {
    if (spec.name != "random_load") continue;
    const auto found = spec.parameters.find("intensity");
    if (found != spec.parameters.end()) return found->second;
  }
  return 0.0;
}

// What a parameter may be off by, relative: the larger of what is allowed and two standard deviations of the fit.
double allowance(const plant::LoopModel& twin, const std::string& name, double allowed) {
  if (!twin.twin) return allowed;
  for (std::size_t i = 0; i < twin.twin->parameters.size(); ++i) {
    if (twin.twin->parameters[i] != name) continue;
    allowed = std::max(allowed, 2.0 * std::sqrt(twin.twin->covariance[i][i]));
  }
  return allowed;
}

double answer_of(const plant::ProcessParameters& p) {
  return p.dead_time_s + p.time_constant_s + p.second_time_constant_s;
}

}  // namespace

TwinWatch::TwinWatch(const plant::LoopModel& twin) {
  plant::LoopModel model = effects::without_noise(twin);
  model.scenario.faults.clear();
  plants_.emplace_back(model, 1);
  const plant::ProcessUncertainty& u = twin.uncertainty;
  plant::LoopModel other = model;
  other.process.gain *= 1.0 + allowance(twin, "gain", u.gain);
  plants_.emplace_back(other, 1);
  other = model;
  const double longer = 1.0 + allowance(twin, "time_constant", u.time_constant);
  other.process.time_constant_s *= longer;
  other.process.second_time_constant_s *= longer;
  plants_.emplace_back(other, 1);
  other = model;
  // Sampling alone hides a part of a period.
  other.process.dead_time_s =
      std::max(other.process.dead_time_s * (1.0 + allowance(twin, "dead_time", u.dead_time)),
               other.process.dead_time_s + twin.sample_time_s);
  plants_.emplace_back(other, 1);

  const double h = twin.sample_time_s;
  const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
  const double span = twin.transmitter.span();
  // A converter of 16 bits where the twin has neither noise nor rounding.
  const double least = span / 65536.0;
  const double noise2 = std::max(
      twin.transmitter.noise * twin.transmitter.noise + rounding * rounding, least * least);
  const double drive2 = load_intensity(twin) * load_intensity(twin) * h;
  // Steady state of the Kalman filter of a random walk under white noise.
  const double ahead2 = 0.5 * (drive2 + std::sqrt(drive2 * drive2 + 4.0 * drive2 * noise2));
  gain_ = std::max(ahead2 / (ahead2 + noise2), 1.0 - std::exp(-h / kForgets_s));
  const control::PidSettings& pid = twin.controller.pid;
  const double moved = twin.process.integrating() ? twin.process.gain * h : twin.process.gain;
  friction_ = 0.5 * kFriction * pid.output_span() * moved;
  noise2_ = noise2 + ahead2;
  const double answer_s = answer_of(twin.process);
  block_ = std::max(kFewestInBlock, static_cast<std::size_t>(std::lround(0.5 * answer_s / h)));
  most_quiet_ = static_cast<std::size_t>(kQuiet_s / (h * static_cast<double>(block_))) + 1;
  warm_up_ = static_cast<std::size_t>(std::lround(5.0 * answer_s / h)) + 10 * block_;
  const auto limit = [](double healthy, double least_limit) {
    return std::max(least_limit, kSlack * healthy);
  };
  size_limit_ = limit(twin.twin ? twin.twin->largest_size : 0.0, kLeastLimitSize);
  colour_limit_ = limit(twin.twin ? twin.twin->largest_colour : 0.0, kLeastLimitColour);
  const plant::TwinFit seen = twin.twin.value_or(plant::TwinFit{});
  const double margin = kOutside * (seen.seen_high - seen.seen_low);
  seen_low_ = seen.seen_low - margin;
  seen_high_ = seen.seen_high + margin;
}

void TwinWatch::start(double pv, double co) noexcept {
  for (std::size_t i = 0; i < plants_.size(); ++i) {
    plants_[i].reset(co);
    predicted_[i] = plants_[i].process_variable();
    load_[i] = i == 0 ? pv - predicted_[0] : predicted_[i] - predicted_[0];
  }
  started_ = true;
  since_start_ = 0;
  begin_block();
}

void TwinWatch::begin_block() noexcept {
  in_block_ = 0;
  sum_size_ = sum_innovation_ = sum_pv_ = 0.0;
  sum_off_.fill(0.0);
}

bool TwinWatch::add(double pv, double co) noexcept {
  if (!std::isfinite(co)) {
    restart();
    return false;
  }
  if (!started_) {
    if (!std::isfinite(pv)) return false;
    start(pv, co);
  }
  bool ended = false;
  if (std::isfinite(pv)) {
    innovation_ = pv - predicted_[0] - load_[0];
    const bool counts = ++since_start_ > warm_up_;
    // What began in the middle of a move takes the move's end for a load: until blocks count, d follows the newest answer.
    const double gain =
        counts ? gain_
               : std::max(gain_, 1.0 / static_cast<double>(std::min(since_start_, 2 * block_)));
    load_[0] += gain * innovation_;
    double allowed = noise2_ + friction_ * friction_;
    for (std::size_t i = 1; i < plants_.size(); ++i) {
      const double off = predicted_[i] - predicted_[0] - load_[i];
      load_[i] += gain * off;
      allowed += off * off;
      if (counts) sum_off_[i] += off;
    }
    if (counts) {
      sum_size_ += innovation_ * innovation_ / allowed;
      sum_innovation_ += innovation_;
      sum_pv_ += pv;
      if (++in_block_ == block_) {
        const double mean_pv = sum_pv_ / static_cast<double>(block_);
        ended = mean_pv >= seen_low_ && mean_pv <= seen_high_;
        if (ended) {
          end_block();
        } else {
          since_start_ = 0;
          begin_block();
        }
      }
    }
  }
  for (std::size_t i = 0; i < plants_.size(); ++i) predicted_[i] = plants_[i].step(co);
  return ended;
}

void TwinWatch::end_block() noexcept {
  size_ = sum_size_ / static_cast<double>(block_);
  const auto samples = static_cast<double>(block_);
  double sum2 = samples * noise2_ + samples * samples * friction_ * friction_;
  for (const double off : sum_off_) sum2 += off * off;
  colour_ = sum_innovation_ * sum_innovation_ / sum2;
  const auto sum = [](double before, double statistic, double limit) {
    return std::clamp(before + std::min(statistic - limit, kMostInBlock), 0.0, 2.0 * kAlarm);
  };
  size_sum_ = sum(size_sum_, size_, size_limit_);
  colour_sum_ = sum(colour_sum_, colour_, colour_limit_);
  if (size_sum_ >= kAlarm || colour_sum_ >= kAlarm) on_ = true;
  const bool low = std::max(size_sum_, colour_sum_) < 0.25 * kAlarm;
  quiet_blocks_ = low ? quiet_blocks_ + 1 : 0;
  if (quiet_blocks_ >= most_quiet_) on_ = false;
  begin_block();
}

}  // namespace loopwarden::monitor
