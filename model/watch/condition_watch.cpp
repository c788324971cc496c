// SPDX-License-Identifier: Apache-2.0
#include "model/watch/condition_watch.hpp"

#include <algorithm>
#include <cmath>

#include "model/alarm/limits.hpp"
#include "model/numeric/root_sum_square.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::watch {
namespace {

double share(std::uint64_t part, std::uint64_t whole) noexcept {
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

ConditionWatch::ConditionWatch(const WindowSettings& settings) noexcept
    : co_span_(settings.co_high - settings.co_low),
      sample_time_s_(settings.sample_time_s),
      resolution_(alarm::AlarmLimits::kResolution_percent / 100.0 * co_span_),
      length_(alarm::kWindowSamples * std::max<std::size_t>(settings.decimation, 1)),
      block_(length_ / Limits::kStemLagBlocks) {}

void ConditionWatch::add(const Cycle& cycle, const Troubles& troubles) noexcept {
  pv_frozen_ = troubles.pv_frozen;
  const std::uint64_t missing =
      any_ && cycle.period_index > last_period_ ? cycle.period_index - last_period_ - 1 : 0;
  // The move across a gap is of unknown duration.
  if (missing > 0) in_block_ = 0;
  any_ = true;
  last_period_ = cycle.period_index;
  const bool read_back = std::isfinite(cycle.stem);
  read_back_seen_ = read_back_seen_ || read_back;
  sums_.cycles += missing + 1;
  sums_.cycle_bad += missing + (troubles.cycle_bad ? 1U : 0U);
  sums_.pv_bad += troubles.pv_bad ? 1U : 0U;
  sums_.read_back_bad += read_back_seen_ && !read_back ? 1U : 0U;
  // While the output is unknown, the stem has no reference for its deviation.
  if (read_back && std::isfinite(cycle.co)) {
    ++sums_.compared;
    follow(cycle.co, cycle.stem);
  } else {
    in_block_ = 0;
  }
  if (sums_.cycles >= length_) close();
}

void ConditionWatch::follow(double co, double stem) noexcept {
  const double error = co - stem;
  sums_.deviation += std::abs(error);
  if (in_block_ == 0) {
    block_start_ = stem;
    block_error_ = 0.0;
  } else {
    // Trapezoids: a stem that jumps within a cycle was late for half of it.
    block_error_ += 0.5 * (last_error_ + error);
  }
  last_error_ = error;
  if (++in_block_ <= block_) return;
  const double move = stem - block_start_;
  if (std::abs(move) > resolution_) {
    sums_.error_by_move += block_error_ * move;
    sums_.move_squared += move * move;
  }
  // The last cycle of a block is the first of the next.
  in_block_ = 1;
  block_start_ = stem;
  block_error_ = 0.0;
}

void ConditionWatch::close() noexcept {
  inputs_.pv_bad_share = share(sums_.pv_bad, sums_.cycles);
  inputs_.cycle_bad_share = share(sums_.cycle_bad, sums_.cycles);
  inputs_.read_back_bad_share = read_back_seen_ ? share(sums_.read_back_bad, sums_.cycles)
                                                : analysis::ConditionInputs::kUnknown;
  const bool known = sums_.compared > 0 && co_span_ > 0.0;
  inputs_.stem_deviation_percent =
      known ? 100.0 * sums_.deviation / static_cast<double>(sums_.compared) / co_span_
            : analysis::ConditionInputs::kUnknown;
  inputs_.stem_lag_s =
      sums_.move_squared > 0.0
          ? std::max(sums_.error_by_move / sums_.move_squared, 0.0) * sample_time_s_
          : analysis::ConditionInputs::kUnknown;
  sums_ = {};
}

alarm::WindowMeasures ConditionWatch::told(alarm::WindowMeasures measures) const noexcept {
  if (changed_ > 0 && last_period_ + 1 < changed_ + length_) {
    measures.stick_percent = 0.0;
    measures.stick_source = alarm::StickSource::none;
  }
  return measures;
}

void ConditionWatch::window(const alarm::WindowMeasures& measures,
                            const alarm::AlarmConditions* conditions) noexcept {
  inputs_.rms_error_percent =
      numeric::root_sum_square(measures.variability_percent, measures.mean_error_percent);
  const alarm::WindowMeasures known = told(measures);
  inputs_.stick_percent = known.stick_source == alarm::StickSource::read_back
                              ? known.stick_percent
                              : analysis::ConditionInputs::kUnknown;
  if (conditions != nullptr) conditions_ = *conditions;
  count_alarms();
}

bool ConditionWatch::verdict(const alarm::AlarmConditions& conditions) noexcept {
  const bool changed = !std::equal(
      conditions.begin(), conditions.end(), conditions_.begin(),
      [](const alarm::AlarmCondition& a, const alarm::AlarmCondition& b) { return a.on == b.on; });
  conditions_ = conditions;
  if (!changed) return false;
  changed_ = last_period_ + 1;
  sums_ = {};
  in_block_ = 0;
  inputs_.stem_deviation_percent = inputs_.stem_lag_s = inputs_.stick_percent =
      analysis::ConditionInputs::kUnknown;
  count_alarms();
  return true;
}

void ConditionWatch::count_alarms() noexcept {
  double& stick = inputs_.stick_percent;
  for (const alarm::AlarmKind kind :
       {alarm::AlarmKind::stiction, alarm::AlarmKind::backlash, alarm::AlarmKind::hysteresis}) {
    const alarm::AlarmCondition& condition = conditions_[index_of(kind)];
    if (condition.on) stick = std::fmax(stick, condition.severity_percent);
  }
  const bool low_air = conditions_[index_of(alarm::AlarmKind::low_air_supply)].on;
  inputs_.actuator_alarm = low_air ? 1.0 : analysis::ConditionInputs::kUnknown;
}

}  // namespace loopwarden::watch
