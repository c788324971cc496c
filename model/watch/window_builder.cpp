// SPDX-License-Identifier: Apache-2.0
#include "model/watch/window_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "model/watch/limits.hpp"

namespace loopwarden::watch {
namespace {

constexpr auto kWindow = static_cast<std::ptrdiff_t>(alarm::kWindowSamples);

}  // namespace

WindowBuilder::WindowBuilder(const WindowSettings& settings) : settings_(settings) {
  settings_.decimation = std::clamp<std::size_t>(settings.decimation, 1, Limits::kMostDecimation);
  settings_.overlap = std::isfinite(settings.overlap)
                          ? std::clamp(settings.overlap, 0.0, Limits::kMostOverlap)
                          : 0.0;
  const auto kept = static_cast<std::ptrdiff_t>(
      std::lround(settings_.overlap * static_cast<double>(alarm::kWindowSamples)));
  advance_ = kWindow - kept;
  for (std::vector<double>* column : {&columns_.sp, &columns_.pv, &columns_.co, &columns_.stem}) {
    column->resize(alarm::kWindowSamples);
  }
  bridged_.resize(alarm::kWindowSamples);
  start_over();
}

void WindowBuilder::start_over() noexcept {
  first_ = 0;
  count_ = 0;
  until_next_ = kWindow;
  in_sample_ = 0;
  sum_sp_ = sum_pv_ = sum_co_ = sum_stem_ = 0.0;
  bridged_in_sample_ = 0;
  window_in_stretch_ = false;
}

alarm::WindowState WindowBuilder::usable(const Cycle& cycle) const noexcept {
  if (!cycle.automatic) return alarm::WindowState::not_automatic;
  if (!cycle.pv_good || !std::isfinite(cycle.pv)) return alarm::WindowState::bad_pv;
  if (!settings_.has_set_point) return alarm::WindowState::no_set_point;
  if (!std::isfinite(cycle.sp) || !std::isfinite(cycle.co)) return alarm::WindowState::gap;
  return alarm::WindowState::valid;
}

WindowBuilder::Progress WindowBuilder::add(const Cycle& cycle) noexcept {
  // A decreasing number is another run, and counts as a gap.
  const std::uint64_t missing = any_ ? cycle.period_index - last_period_ - 1 : 0;
  any_ = true;
  last_period_ = cycle.period_index;
  const alarm::WindowState can_use = usable(cycle);
  if (can_use != alarm::WindowState::valid) {
    const bool news = !broken_ || state_ != can_use;
    start_over();
    broken_ = true;
    state_ = can_use;
    return news ? Progress::broken : Progress::none;
  }
  Progress event = Progress::none;
  if (broken_) {
    state_ = alarm::WindowState::filling;
  } else if (missing > 0) {
    if (missing > Limits::kLongestBridge * settings_.decimation || !bridge(cycle, missing)) {
      start_over();
      state_ = alarm::WindowState::gap;
      event = Progress::broken;
    }
  }
  broken_ = false;
  append(cycle, false);
  if (until_next_ > 0) return event;
  until_next_ += advance_;
  window_in_stretch_ = true;
  state_ = alarm::WindowState::valid;
  put_in_order();
  return Progress::full;
}

std::size_t WindowBuilder::bridged_in_window() const noexcept {
  return std::accumulate(bridged_.begin(), bridged_.begin() + static_cast<std::ptrdiff_t>(count_),
                         std::size_t{bridged_in_sample_});
}

bool WindowBuilder::bridge(const Cycle& cycle, std::uint64_t missing) noexcept {
  const std::size_t most = Limits::kMostBridged * settings_.decimation;
  if (bridged_in_window() + missing > most) return false;
  const Cycle from = last_;
  for (std::uint64_t i = 1; i <= missing; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(missing + 1);
    Cycle made_up = from;
    made_up.pv += share * (cycle.pv - from.pv);
    made_up.stem += share * (cycle.stem - from.stem);
    append(made_up, true);
  }
  return true;
}

void WindowBuilder::append(const Cycle& cycle, bool made_up) noexcept {
  last_ = cycle;
  if (made_up) ++bridged_in_sample_;
  sum_sp_ += cycle.sp;
  sum_pv_ += cycle.pv;
  sum_co_ += cycle.co;
  sum_stem_ += cycle.stem;
  if (++in_sample_ < settings_.decimation) return;
  const auto n = static_cast<double>(in_sample_);
  const std::size_t at = (first_ + count_) % alarm::kWindowSamples;
  columns_.sp[at] = sum_sp_ / n;
  columns_.pv[at] = sum_pv_ / n;
  columns_.co[at] = sum_co_ / n;
  columns_.stem[at] = sum_stem_ / n;
  bridged_[at] = bridged_in_sample_;
  in_sample_ = 0;
  bridged_in_sample_ = 0;
  sum_sp_ = sum_pv_ = sum_co_ = sum_stem_ = 0.0;
  if (count_ < alarm::kWindowSamples) {
    ++count_;
  } else {
    first_ = (first_ + 1) % alarm::kWindowSamples;
  }
  --until_next_;
}

void WindowBuilder::put_in_order() noexcept {
  const auto oldest = static_cast<std::ptrdiff_t>(first_);
  for (std::vector<double>* column : {&columns_.sp, &columns_.pv, &columns_.co, &columns_.stem}) {
    std::rotate(column->begin(), column->begin() + oldest, column->end());
  }
  std::rotate(bridged_.begin(), bridged_.begin() + oldest, bridged_.end());
  first_ = 0;
}

alarm::Window WindowBuilder::window() const noexcept {
  const auto column = [&](const std::vector<double>& values) {
    return std::span<const double>(values).first(count_);
  };
  return {{.period_s = settings_.sample_time_s * static_cast<double>(settings_.decimation),
           .pv = column(columns_.pv),
           .sp = column(columns_.sp),
           .co = column(columns_.co),
           .stem = column(columns_.stem),
           .pv_low = settings_.pv_low,
           .pv_high = settings_.pv_high,
           .co_low = settings_.co_low,
           .co_high = settings_.co_high},
          bridged_in_window()};
}

double WindowBuilder::filled() const noexcept {
  const std::ptrdiff_t wanted = window_in_stretch_ ? advance_ : kWindow;
  return 1.0 - static_cast<double>(until_next_) / static_cast<double>(wanted);
}

}  // namespace loopwarden::watch
