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
  std::uint64_t id = 0;      // 0: none yet
  bool write = false;
  bool alarm = true;
  bool parked = false;  // the loop has stopped on purpose: the output stays, whatever the age
};

// From the I/O thread to the loop.
struct AnalogState {
  Inputs inputs;
  OutputStage stage;
  bool stage_known = false;
  std::uint64_t written_id = 0;  // newest command that the converter has taken
  std::int64_t time_ns = 0;      // of the turn that found all this
};

// All that the I/O thread of a loop does, without the thread: sysfs reads and writes may block.
//
// Nothing watches a converter on the same board, so the task does what elsewhere the device's
// communication watchdog does: when the loop's commands cease to come it puts out the safe current.
// Against a process that is dead or stopped it can do nothing; the alive line is for that.
class AnalogTask {
 public:
  AnalogTask(const AnalogSettings& settings, const std::string& name, GpioChips& chips,
             const EventSink& sink);

  base::NewestValue<AnalogCommand> commands;
  base::NewestValue<AnalogState> state;

  void open(std::int64_t now_ns);
  void close() noexcept { digital_.close(); }
  // One turn: inputs when they are due, commands and lines always.
  void step(std::int64_t now_ns);
  // When step() should be called again at the latest.
  std::int64_t due_ns(std::int64_t now_ns) const noexcept;

  IoCounters counters() const noexcept;  // any thread

 private:
  void serve_command(std::int64_t now_ns);
  void withhold(std::int64_t now_ns);
  void publish(std::int64_t now_ns) noexcept;
  void publish_counters() noexcept;

  const std::int64_t poll_period_ns_;
  const std::int64_t max_command_age_ns_;
  const std::int64_t slice_ns_;  // how long a command may wait
  AnalogInput process_variable_;
  std::optional<AnalogInput> read_back_;
  AnalogOutput output_;
  DigitalIo digital_;

  std::int64_t next_poll_ns_ = 0;
  std::optional<std::int64_t> last_turn_ns_;
  std::int64_t resumed_ns_ = 0;  // this thread had hung until then
  AnalogCommand command_;
  bool commanded_ = false;    // a command that is to be put out has come at some time
  bool withholding_ = false;  // the loop's commands have ceased to come
  bool safe_put_ = false;     // the safe current stands, since then
  std::int64_t safe_retry_ns_ = 0;
  bool adrift_ = false;  // they had ceased, and no command was put out since
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
