// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/contract/loop_io.hpp"
#include "hal/iio/analog_input.hpp"
#include "hal/iio/analog_output.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/iio/digital_io.hpp"
#include "hal/iio/output_stage.hpp"
#include "base/newest_value.hpp"

namespace loopwarden::hal::iio {

// From the loop to the I/O thread.
struct AnalogCommand {
  double output = 0.0;       // CO units
  std::int64_t time_ns = 0;  // when the loop decided
  std::uint64_t id = 0;      // 0: no command yet
  bool write = false;
  bool alarm = true;
  bool parked = false;  // the loop was stopped on purpose: the output stays, whatever its age
};

// From the I/O thread to the loop.
struct AnalogState {
  Inputs inputs;
  OutputStage stage;
  bool stage_known = false;
  std::uint64_t written_id = 0;  // newest command that the converter has accepted
  std::int64_t time_ns = 0;      // of the turn that read these values
};

// The work of a loop's I/O thread, without the thread. Its sysfs reads and writes may block.
//
// A converter on the same board has no watchdog. The task therefore replaces the communication
// watchdog of other devices: if the loop's commands stop, it outputs the safe current. It can't act
// if the process is dead or stopped; the alive line covers that case.
class AnalogTask {
 public:
  AnalogTask(const AnalogSettings& settings, const std::string& name, GpioChips& chips,
             const EventSink& sink);

  base::NewestValue<AnalogCommand> commands;
  base::NewestValue<AnalogState> state;

  void open(std::int64_t now_ns);
  void close() noexcept { digital_.close(); }
  // Runs one turn: reads inputs that are due, and always serves commands and lines.
  void step(std::int64_t now_ns);
  // Returns the latest time for the next step().
  std::int64_t due_ns(std::int64_t now_ns) const noexcept;

  IoCounters counters() const noexcept;  // any thread

 private:
  void serve_command(std::int64_t now_ns);
  void withhold(std::int64_t now_ns);
  void publish(std::int64_t now_ns) noexcept;
  void publish_counters() noexcept;

  const std::int64_t poll_period_ns_;
  const std::int64_t max_command_age_ns_;
  const std::int64_t slice_ns_;  // longest wait of a command
  AnalogInput process_variable_;
  std::optional<AnalogInput> read_back_;
  AnalogOutput output_;
  DigitalIo digital_;

  std::int64_t next_poll_ns_ = 0;
  std::optional<std::int64_t> last_turn_ns_;
  std::int64_t resumed_ns_ = 0;  // end of the newest hang of this thread
  AnalogCommand command_;
  bool commanded_ = false;    // at least one command to be output has arrived
  bool withholding_ = false;  // the loop's commands have stopped
  bool safe_put_ = false;     // the safe current was output since they stopped
  std::int64_t safe_retry_ns_ = 0;
  bool adrift_ = false;  // commands had stopped, and no command was output since
  std::uint64_t written_id_ = 0;

  // Written by the I/O thread, read by any.
  struct Counters {
    std::atomic<std::uint64_t> transactions{0};
    std::atomic<std::uint64_t> device_exceptions{0};
    std::atomic<std::uint64_t> invalid_replies{0};
    std::atomic<std::uint64_t> reconnects{0};
    std::atomic<std::uint64_t> writes{0};
    std::atomic<std::uint64_t> write_errors{0};
    std::atomic<std::uint64_t> old_commands_withheld{0};
    std::atomic<bool> connected{false};
  };
  Counters counters_;
  std::uint64_t withheld_ = 0;
};

}  // namespace loopwarden::hal::iio
