// SPDX-License-Identifier: Apache-2.0
#include "model/watch/twin_watch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "model/effects/catalogue.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/load_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::watch {
namespace {

constexpr double kNever = 1e300;
constexpr double kLeastVariance = 1e-6;

// Relative standard deviation of a parameter.
double deviation(const plant::LoopModel& twin, const std::string& name) {
  if (!twin.twin) return 0.0;
  for (std::size_t i = 0; i < twin.twin->parameters.size(); ++i) {
    if (twin.twin->parameters[i] == name) return std::sqrt(twin.twin->covariance[i][i]);
  }
  return 0.0;
}

struct Changed {
  plant::LoopModel model;
  double spread = 0.0;  // c
};

// In the order of TwinChange.
std::vector<Changed> changes(const plant::LoopModel& twin, const plant::LoopModel& model) {
  const plant::ProcessParameters& p = model.process;
  std::vector<Changed> out;
  const auto with = [&](double spread, const auto& change) {
    out.push_back({model, spread});
    change(out.back().model);
  };
  with(std::max(Limits::kGainSpread, deviation(twin, "gain")) / Limits::kChangedGain,
       [&](auto& m) { m.process.gain *= 1.0 + Limits::kChangedGain; });
  with(std::max(Limits::kTimeSpread, deviation(twin, "time_constant")) / Limits::kChangedTimes,
       [&](auto& m) {
         m.process.time_constant_s *= 1.0 + Limits::kChangedTimes;
         m.process.second_time_constant_s *= 1.0 + Limits::kChangedTimes;
       });
  const double later_s = std::max({Limits::kChangedTimes * p.dead_time_s, Limits::kLeastLater_s,
                                   Limits::kLeastLaterSamples * twin.sample_time_s});
  // The sampling itself hides a part of a period.
  const double dead_time_spread_s =
      std::max(std::max(Limits::kDeadTimeSpread, deviation(twin, "dead_time")) * p.dead_time_s,
               std::max(Limits::kLeastDeadTimeSpread_s, twin.sample_time_s));
  with(dead_time_spread_s / later_s, [&](auto& m) { m.process.dead_time_s += later_s; });
  with(Limits::kLagSpread, [&](auto& m) {
    m.process.second_time_constant_s += Limits::kChangedTimes * plant::answer_s(model);
  });
  const double size = Limits::kChangedValve * twin.controller.pid.output_span();
  const double friction = Limits::kHealthyFriction * twin.controller.pid.output_span();
  with(Limits::kFrictionSpread * friction / size, [&](auto& m) {
    m.valve_effects.push_back({"backlash", {{"deadband", size}}});
  });
  with(Limits::kFrictionSpread * friction / size, [&](auto& m) {
    m.valve_effects.push_back({"stiction", {{"s", size}, {"j", 0.5 * size}}});
  });
  return out;
}

double gain_within(double time_s, double period_s) { return 1.0 - std::exp(-period_s / time_s); }

}  // namespace

const char* to_text(TwinChange change) noexcept {
  return numeric::enum_name<TwinChange::stick>(
      change, {"gain", "time_constant", "dead_time", "lag", "play", "stick"});
}

TwinWatch::TwinWatch(const plant::LoopModel& twin)
    : sample_time_s_(twin.sample_time_s), integrating_(twin.process.integrating()) {
  plant::LoopModel model = plant::without_noise(twin);
  model.scenario.faults.clear();
  plants_.emplace_back(model, 1);
  const std::vector<Changed> changed = changes(twin, model);
  for (std::size_t i = 0; i < kTwinChanges; ++i) {
    plants_.emplace_back(changed[i].model, 1);
    spread_[i] = changed[i].spread;
  }

  const double h = twin.sample_time_s;
  const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
  // Used if the twin has neither noise nor rounding: a converter of 16 bits.
  const double least = twin.transmitter.span() / 65536.0;
  noise2_ = std::max(twin.transmitter.noise * twin.transmitter.noise + rounding * rounding,
                     least * least);
  // Steady state of the Kalman filter of a random walk under white noise.
  const auto kalman = [&](double intensity) {
    const double drive2 = intensity * intensity * h;
    const double ahead2 = 0.5 * (drive2 + std::sqrt(drive2 * drive2 + 4.0 * drive2 * noise2_));
    return ahead2 / (ahead2 + noise2_);
  };
  const double answer_s = std::max(plant::answer_s(twin), h);
  const double intensity = load_intensity(twin);
  const double slowest = std::max(kalman(intensity), gain_within(Limits::kForgets_s, h));
  const double fastest = std::max({slowest, kalman(Limits::kMoreLoad * intensity),
                                   gain_within(answer_s / Limits::kFastest, h)});
  const double moved = integrating_ ? twin.process.gain * answer_s : twin.process.gain;
  const double friction =
      0.5 * Limits::kHealthyFriction * twin.controller.pid.output_span() * moved / std::sqrt(3.0);
  for (std::size_t f = 0; f < kFilters; ++f) {
    Filter& filter = filters_[f];
    filter.gain = slowest * std::pow(fastest / slowest, static_cast<double>(f) / (kFilters - 1.0));
    const double memory_s = std::min(answer_s, h / filter.gain);
    filter.friction2 = friction * friction * (memory_s / answer_s) * (memory_s / h);
    filter.variance = Limits::kMoreThanNoise * noise2_;
  }
  keep_ = {std::exp(-h / (Limits::kShort * answer_s)), std::exp(-h / Limits::kLong_s)};
  variance_gain_ = h / (Limits::kVarianceAnswers * answer_s);
  answer_ = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(answer_s / h)));
  warm_up_ = static_cast<std::size_t>(std::lround(Limits::kWarmUp * answer_s / h)) +
             Limits::kWarmUpSamples;
  again_ =
      static_cast<std::size_t>(std::lround(Limits::kAgain * answer_s / h)) + Limits::kAgainSamples;
  block_ = std::max<std::size_t>(1, answer_ / 10);
  most_quiet_ = static_cast<std::size_t>(Limits::kQuiet_s / h);
  const plant::TwinFit fit = twin.twin.value_or(plant::TwinFit{});
  limit_ = std::max(Limits::kTwinAlarm, Limits::kSlack * fit.largest);
  pv_ = {fit.seen_low, fit.seen_high, fit.seen_high - fit.seen_low};
  co_ = {fit.co_low, fit.co_high, fit.co_high - fit.co_low};
}

double TwinWatch::Shown::beyond(double x) const noexcept {
  const double out = std::max(low - x, x - high);
  return out > 0.0 ? out / range : 0.0;
}

void TwinWatch::start(double co) noexcept {
  for (std::size_t i = 0; i < plants_.size(); ++i) {
    plants_[i].reset(co);
    predicted_[i] = plants_[i].process_variable();
  }
  sums_ = {};
  largest_ = 0.0;
  in_block_ = 0;
  since_start_ = since_reset_ = jumped_ = 0;
  started_ = true;
}

bool TwinWatch::add(double pv, double co) noexcept {
  if (!std::isfinite(co)) {
    restart();
    return false;
  }
  if (!started_) {
    if (!std::isfinite(pv)) return false;
    start(co);
  }
  for (std::size_t& samples : untested_) ++samples;
  counts_ = false;
  if (std::isfinite(pv)) {
    std::array<double, kSeries> series{};
    residual_ = series[0] = pv - predicted_[0];
    for (std::size_t i = 1; i < kSeries; ++i) series[i] = predicted_[i] - predicted_[0];
    beyond_ = std::max(pv_.beyond(pv), co_.beyond(co));
    inside_ = beyond_ <= Limits::kOutside;
    if (!inside_) since_start_ = 0;
    if (since_start_ == 0) {
      for (Filter& filter : filters_) {
        filter.level = series;
        filter.slope = {};
      }
    }
    ++since_start_;
    ++since_reset_;
    counts_ = inside_ && since_reset_ > warm_up_ && since_start_ > again_;
    // A start in the middle of a move would take the move's end for a load. Until samples count, d
    // follows the newest answer.
    const double least = counts_ ? 0.0 : 1.0 / static_cast<double>(std::min(since_start_, answer_));
    for (std::size_t f = 0; f < kFilters; ++f) {
      follow(filters_[f], series, least);
      if (counts_) count(filters_[f], sums_[f]);
    }
    if (counts_ && load_jumps()) since_start_ = 0;
  }
  for (std::size_t i = 0; i < plants_.size(); ++i) predicted_[i] = plants_[i].step(co);
  if (!counts_ || ++in_block_ < block_) return false;
  judge();
  return true;
}

void TwinWatch::follow(Filter& filter, const std::array<double, kSeries>& series,
                       double least) noexcept {
  const double gain = std::max(filter.gain, least);
  for (std::size_t i = 0; i < kSeries; ++i) {
    const double left = series[i] - filter.level[i];
    filter.left[i] = left;
    filter.level[i] += gain * left + filter.slope[i];
    if (integrating_) filter.slope[i] += 0.25 * gain * gain * left;
  }
}

void TwinWatch::count(Filter& filter, std::array<Sums, kScales>& sums) noexcept {
  const double n2 = filter.left[0] * filter.left[0];
  filter.variance +=
      variance_gain_ * (std::min(n2, Limits::kMostOfNoise * noise2_) - filter.variance);
  filter.variance = std::max(filter.variance, Limits::kMoreThanNoise * noise2_);
  const double most = Limits::kMostSigmas * std::sqrt(filter.variance);
  const double n = std::clamp(filter.left[0], -most, most);
  const double v = filter.variance + filter.friction2;
  const double unsure = 1.0 + Limits::kUnsure * beyond_;
  for (std::size_t scale = 0; scale < kScales; ++scale) {
    Sums& sum = sums[scale];
    const double keep = keep_[scale];
    for (std::size_t i = 0; i < kTwinChanges; ++i) {
      const double weighed = filter.left[i + 1] / v;
      sum.up[i] = keep * sum.up[i] + n * weighed;
      sum.squares[i] = keep * keep * sum.squares[i] + filter.left[i + 1] * weighed;
      for (std::size_t j = 0; j <= i; ++j) {
        const double product = filter.left[j + 1] * weighed;
        sum.gram[i][j] = keep * sum.gram[i][j] + product;
        sum.unsure[i][j] = keep * sum.unsure[i][j] + unsure * product;
      }
    }
  }
}

// Returns whether PV moves to values that CO can't cause.
bool TwinWatch::load_jumps() noexcept {
  const Filter& fast = filters_.back();
  double most = Limits::kJumpSigmas * std::sqrt(fast.variance);
  double change = 0.0;
  for (std::size_t i = 1; i < kSeries; ++i) change = std::max(change, std::abs(fast.left[i]));
  most += Limits::kMostChange * change;
  jumped_ = std::abs(fast.left[0]) > most ? jumped_ + 1 : 0;
  return jumped_ >= Limits::kJumpSamples;
}

// Returns the variance of a sum of n s/v while the plant is within the twin's spread.
double TwinWatch::variance_of(const Sums& sums, std::size_t change) const noexcept {
  double variance = sums.squares[change];
  for (std::size_t j = 0; j < kTwinChanges; ++j) {
    const double gram = spread_[j] * sums.unsure_of(change, j);
    variance += gram * gram;
  }
  return variance;
}

void TwinWatch::judge() noexcept {
  largest_ = 0.0;
  for (std::size_t i = 0; i < kTwinChanges; ++i) {
    for (std::size_t scale = 0; scale < kScales; ++scale) {
      double z = kNever;
      std::array<double, kTwinChanges> would{};  // z with kTested times each change
      would.fill(kNever);
      for (std::size_t f = 0; f < kFilters; ++f) {
        const Sums& sums = sums_[f][scale];
        const double variance = variance_of(sums, i) + kLeastVariance;
        z = std::min(z, sums.up[i] * sums.up[i] / variance);
        for (std::size_t j = 0; j < kTwinChanges; ++j) {
          const double size = Limits::kTested * sums.of(i, j);
          would[j] = std::min(would[j], size * size / variance);
        }
      }
      for (std::size_t j = 0; j < kTwinChanges; ++j) {
        if (would[j] < limit_) continue;
        untested_[j] = 0;
        tested_[j] = true;
      }
      if (z <= largest_) continue;
      largest_ = z;
      leading_ = static_cast<TwinChange>(i);
    }
  }
  if (largest_ >= limit_) on_ = true;
  quiet_samples_ = quiet() ? quiet_samples_ + in_block_ : 0;
  if (quiet_samples_ >= most_quiet_) on_ = false;
  in_block_ = 0;
}

double TwinWatch::untested_s(TwinChange change) const noexcept {
  return static_cast<double>(untested_[static_cast<std::size_t>(change)]) * sample_time_s_;
}

TwinWatch::Sample TwinWatch::newest(TwinChange change) const noexcept {
  if (!counts_) return {};
  const Filter& filter = filters_[1];
  const double v = filter.variance + filter.friction2;
  const double s = filter.left[static_cast<std::size_t>(change) + 1];
  const double most = Limits::kMostSigmas * std::sqrt(filter.variance);
  return {std::clamp(filter.left[0], -most, most) * s / v, s * s / v};
}

}  // namespace loopwarden::watch
