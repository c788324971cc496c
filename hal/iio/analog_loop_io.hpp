// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "hal/contract/loop_io.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/iio/analog_task.hpp"
#include "hal/iio/event_sink.hpp"
#include "hal/iio/gpio_lines.hpp"
#include "base/clock.hpp"
#include "base/thread.hpp"

namespace loopwarden::hal::iio {

// A loop on 4-20 mA converters (Linux IIO) and GPIO lines, with its own I/O thread.
class AnalogLoopIo final : public LoopIo {
 public:
  // `name` is the loop's, for events. If `chips` is null, the GPIO chips of this machine are used.
  AnalogLoopIo(AnalogSettings settings, std::string name, EventSink sink = {},
               std::unique_ptr<GpioChips> chips = {});
  ~AnalogLoopIo() override;

  void open() override;
  void close() noexcept override;
  bool drive(double output, std::chrono::milliseconds timeout, std::string& why) override;

  void read(const CycleTime& time, Inputs& inputs) noexcept override;
  double write(const CycleTime& time, const Command& command) noexcept override;

  IoCounters counters() const noexcept override { return task_.counters(); }
  bool has_thread() const noexcept override { return true; }
  std::uint64_t ticks() const noexcept override { return ticks_.load(std::memory_order_relaxed); }

 private:
  void run();
  double output_stage(double output) noexcept;

  const AnalogSettings settings_;
  const std::string name_;
  const EventSink sink_;
  const std::unique_ptr<GpioChips> chips_;
  AnalogTask task_;
  base::MonotonicClock clock_;
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;

  // Thread that runs the loop only.
  AnalogCommand command_;
};

}  // namespace loopwarden::hal::iio
