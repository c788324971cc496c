// SPDX-License-Identifier: Apache-2.0
#include "model/watch/load_watch.hpp"

#include <algorithm>
#include <cmath>

#include "model/watch/limits.hpp"

namespace loopwarden::watch {
double load_intensity(const plant::LoopModel& model) {
  const auto load = std::find_if(model.disturbances.begin(), model.disturbances.end(),
                                 [](const auto& spec) { return spec.name == "random_load"; });
  if (load == model.disturbances.end()) return 0.0;
  const auto found = load->parameters.find("intensity");
  return found == load->parameters.end() ? 0.0 : found->second;
}

LoadWatch::LoadWatch(const plant::LoopModel& twin)
    : known_(twin.twin && twin.twin->load.has_value()), sample_time_s_(twin.sample_time_s) {
  const double h = sample_time_s_;
  const plant::SeenLoad seen = known_ ? *twin.twin->load : plant::SeenLoad{};
  mean_ = seen.mean;
  const double least = Limits::kLeastOutside * twin.transmitter.span();
  const double intensity = load_intensity(twin);
  const double deviation =
      std::max(seen.deviation, intensity * std::sqrt(0.5 * Limits::kLoadTime_s));
  // The mean of the healthy record is only as certain as its length allows.
  const double of_mean = 2.0 * Limits::kLoadTime_s / Limits::kHealthy_s;
  const double of_hours = Limits::kLoadTime_s / Limits::kHours_s;
  limits_ = {std::max(least, Limits::kDeviations * deviation),
             std::max(least, Limits::kDeviations * deviation * std::sqrt(of_mean + of_hours))};
  block_ = std::max(
      Limits::kFewestInBlock,
      static_cast<std::size_t>(std::lround(Limits::kBlockAnswers * plant::answer_s(twin) / h)));
  const double apart_s = 2.5 * static_cast<double>(block_) * h;
  const double noise2 = twin.transmitter.noise * twin.transmitter.noise;
  const double step =
      std::sqrt(intensity * intensity * apart_s + noise2 / static_cast<double>(block_));
  step_limit_ = std::max({least, Limits::kDeviations * step, Limits::kSlack * seen.step});
  settled_ = static_cast<std::size_t>(Limits::kMinutes_s / h);
}

void LoadWatch::add(double r) noexcept {
  if (outside_s_ > 0.0) outside_s_ += sample_time_s_;
  stands_s_ += sample_time_s_;
  if (!std::isfinite(r)) {
    in_block_ = full_blocks_ = 0;
    sum_ = 0.0;
    return;
  }
  ++samples_;
  const double h = sample_time_s_;
  const auto gain = [&](double time_s) {
    return std::max(std::min(1.0, h / time_s), 1.0 / static_cast<double>(samples_));
  };
  means_[0] += gain(Limits::kMinutes_s) * (r - means_[0]);
  means_[1] += gain(Limits::kHours_s) * (r - means_[1]);
  sum_ += r;
  if (++in_block_ == block_) {
    std::rotate(blocks_.begin(), blocks_.begin() + 1, blocks_.end());
    blocks_.back() = sum_ / static_cast<double>(block_);
    sum_ = 0.0;
    in_block_ = 0;
    ++full_blocks_;
    judge_step();
  }
  if (stepped_ != 0.0) {
    const bool back =
        stands_s_ >= Limits::kMinutes_s && std::abs(means_[0] - from_) < 0.5 * std::abs(stepped_);
    if (back || stands_s_ >= Limits::kStands_s) stepped_ = 0.0;
  }
  if (!level_outside() && stepped_ == 0.0) {
    outside_s_ = 0.0;
  } else if (outside_s_ == 0.0) {
    outside_s_ = sample_time_s_;
  }
}

bool LoadWatch::level_outside() const noexcept {
  if (samples_ < settled_) return false;
  const double share = outside_s_ > 0.0 ? Limits::kBack : 1.0;
  const bool hours = static_cast<double>(samples_) * sample_time_s_ >= Limits::kHours_s;
  return std::abs(means_[0] - mean_) >= share * limits_[0] ||
         (hours && std::abs(means_[1] - mean_) >= share * limits_[1]);
}

void LoadWatch::judge_step() noexcept {
  step_ = 0.0;
  if (full_blocks_ < blocks_.size()) return;
  const double before = 0.5 * (blocks_[0] + blocks_[1]);
  const double first = blocks_[3] - before;
  const double second = blocks_[4] - before;
  if (first * second <= 0.0) return;
  step_ = std::copysign(std::min(std::abs(first), std::abs(second)), first);
  if (std::abs(step_) < step_limit_) return;
  if (stepped_ == 0.0 || std::abs(step_) > std::abs(stepped_)) {
    stepped_ = step_;
    from_ = before;
    stands_s_ = 0.0;
  }
}

std::optional<LoadOutside> LoadWatch::outside() const noexcept {
  if (!known_ || outside_s_ <= 0.0) return std::nullopt;
  return LoadOutside{stepped_ != 0.0 ? stepped_ : means_[0] - mean_, outside_s_};
}

}  // namespace loopwarden::watch
