// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/replay_loop_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace loopwarden::hal::replay {
namespace {
constexpr double kLargestPeriodError = 0.01;  // of the loop's sample time
}

record::Record read_replayed(const ReplaySettings& settings) {
  record::Record record = record::read_record(settings.record);
  if (!(std::abs(record.period_s - settings.sample_time_s) <=
        kLargestPeriodError * settings.sample_time_s)) {
    throw std::runtime_error(
        fmt::format("{}: its period is {:.6g} s, the loop's sample time {:.6g} s", settings.record,
                    record.period_s, settings.sample_time_s));
  }
  return record;
}

void ReplayLoopIo::open() {
  record_ = read_replayed(settings_);
  read_back_ = nullptr;
  if (!record_.co.empty()) read_back_ = &record_.co;
  if (!record_.stem.empty()) read_back_ = &record_.stem;
  started_ = false;
  last_output_ = settings_.output_low;
  inputs_ = {};
  inputs_.valve_position_fitted = read_back_ != nullptr;
  inputs_.output_ok = true;
  inputs_.output_reason = Reason::none;
  ended_.store(false, std::memory_order_relaxed);
}

void ReplayLoopIo::read(const CycleTime& time, Inputs& inputs) noexcept {
  if (!started_ || time.period_index < first_period_) first_period_ = time.period_index;
  started_ = true;
  const std::uint64_t passed = time.period_index - first_period_;
  const bool ended = record_.size() == 0 || (!settings_.repeat && passed >= record_.size());
  ended_.store(ended, std::memory_order_relaxed);
  if (ended) {
    for (Sample* sample : {&inputs_.process_variable, &inputs_.valve_position}) {
      sample->quality = Quality::bad;
      sample->reason = Reason::end_of_record;
    }
  } else {
    const std::size_t row = static_cast<std::size_t>(passed % record_.size());
    take(record_.pv, row, time.now_ns, inputs_.process_variable);
    if (read_back_ != nullptr) take(*read_back_, row, time.now_ns, inputs_.valve_position);
    rows_.store(rows_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  inputs = inputs_;
}

// A missing sample keeps value, time and sequence of the last good one.
void ReplayLoopIo::take(const std::vector<double>& column, std::size_t row, std::int64_t now_ns,
                        Sample& sample) const noexcept {
  if (std::isnan(column[row])) {
    sample.quality = Quality::bad;
    sample.reason = Reason::link_lost;
    return;
  }
  sample = {.value = column[row],
            .time_ns = now_ns,
            .sequence = sample.sequence + 1,
            .quality = Quality::good,
            .reason = Reason::none,
            .limit = Limit::none};
}

double ReplayLoopIo::output_stage(double output) const noexcept {
  const double low = settings_.output_low;
  const double high = settings_.output_high;
  const double limited = std::clamp(output, low, high);
  const double step = settings_.output_resolution;
  if (!(step > 0.0)) return limited;
  return std::min(low + step * std::nearbyint((limited - low) / step), high);
}

double ReplayLoopIo::write(const CycleTime&, const Command& command) noexcept {
  if (!command.write || !std::isfinite(command.output)) return last_output_;
  last_output_ = output_stage(command.output);
  writes_.store(writes_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  return last_output_;
}

bool ReplayLoopIo::drive(double output, std::chrono::milliseconds, std::string& why) {
  if (!std::isfinite(output)) {
    why = "not a finite number";
    return false;
  }
  last_output_ = output_stage(output);
  return true;
}

IoCounters ReplayLoopIo::counters() const noexcept {
  IoCounters counters;
  counters.transactions = rows_.load(std::memory_order_relaxed);
  counters.writes = writes_.load(std::memory_order_relaxed);
  counters.connected = !ended_.load(std::memory_order_relaxed);
  return counters;
}

}  // namespace loopwarden::hal::replay
