// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/contract/loop_io.hpp"
#include "record/record_csv.hpp"
#include "hal/replay/replay_settings.hpp"

namespace loopwarden::hal::replay {

// Reads the record of a loop. Throws record::RecordError. Throws std::runtime_error if the record's
// period differs from the loop's.
record::Record read_replayed(const ReplaySettings& settings);

// Replaces the transmitter by a record: one row per control period. The read-back is the record's
// column `stem`; if missing, column `co`; otherwise it is not fitted. Commands are limited and
// quantised as for a real output, but not sent. A missing sample is bad. All samples after the end
// are bad, unless the record repeats.
class ReplayLoopIo final : public LoopIo {
 public:
  explicit ReplayLoopIo(const ReplaySettings& settings) : settings_(settings) {}

  // Throws as read_replayed().
  void open() override;
  void close() noexcept override {}
  bool drive(double output, std::chrono::milliseconds timeout, std::string& why) override;

  void read(const CycleTime& time, Inputs& inputs) noexcept override;
  double write(const CycleTime& time, const Command& command) noexcept override;

  IoCounters counters() const noexcept override;

 private:
  void take(const std::vector<double>& column, std::size_t row, std::int64_t now_ns,
            Sample& sample) const noexcept;
  double output_stage(double output) const noexcept;

  const ReplaySettings settings_;
  record::Record record_;
  const std::vector<double>* read_back_ = nullptr;  // a column of record_; null: not fitted

  bool started_ = false;
  std::uint64_t first_period_ = 0;
  Inputs inputs_;
  double last_output_ = 0.0;  // CO units
  std::atomic<std::uint64_t> rows_{0};
  std::atomic<std::uint64_t> writes_{0};
  std::atomic<bool> ended_{true};
};

}  // namespace loopwarden::hal::replay
