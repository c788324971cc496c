// SPDX-License-Identifier: Apache-2.0
// The work of one link for one loop in each poll period. The bus thread and the loop's thread
// exchange the newest values through it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/contract/device.hpp"
#include "hal/contract/sample.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/pdu.hpp"
#include "hal/modbus/register_codec.hpp"
#include "base/newest_value.hpp"

namespace loopwarden::hal::modbus {

// A read of some registers.
struct ReadShape {
  std::uint8_t unit = 0;
  ReadFunction function = ReadFunction::holding_registers;
  std::uint16_t address = 0;
  std::uint16_t needed = 0;
  std::uint16_t count = 0;  // requested (reply_lengths.hpp)
};

// Consecutive requests of one point without a reply. Bus thread only.
struct Silence {
  int failures = 0;
  std::uint64_t unit_answers = 0;  // replies of the unit up to the newest failure
};

// A value that the bus thread reads for the loop.
struct ReadPoint {
  explicit ReadPoint(const PointSettings& point);

  const PointSettings settings;
  base::NewestValue<Sample> newest;  // bus thread to loop

  // Bus thread only.
  ReadShape value_read;
  std::optional<ReadShape> status_read;
  Sample sample;
  Silence silence;
  std::int64_t ask_again_ns = 0;  // not read before this time: the unit answers, but not for this
                                  // point
};

struct BusCommand {
  double value = 0.0;        // CO units
  std::int64_t time_ns = 0;  // when the loop decided
  std::uint64_t id = 0;      // 0: no command yet
  bool write = false;
};

struct OutputState {
  bool ok = false;
  Reason reason = Reason::never_received;
  std::uint64_t written_id = 0;   // newest command that the device has confirmed
  std::int64_t confirmed_ns = 0;  // when that one was sent
};

// A value that the bus thread writes in each period while the loop renews it.
struct CommandPoint {
  CommandPoint(const PointSettings& point, std::int64_t maximum_age_ns, std::int64_t silence_ns,
               const CommLossSettings& comm_loss);

  // NewestValue members first: they are aligned to cache lines.
  base::NewestValue<BusCommand> newest;  // loop to bus thread
  base::NewestValue<OutputState> state;  // bus thread to loop
  const PointSettings settings;
  const std::int64_t max_age_ns;
  const std::int64_t longest_silence_ns;
  const std::optional<WatchdogRegister> watchdog;

  // Bus thread only.
  OutputState output;
  std::uint64_t armed_epoch = 0;  // state of the unit when its watchdog was set
  std::int64_t watchdog_check_ns = 0;
  std::optional<ReadShape> watchdog_read;
  Registers watchdog_held;  // register value of the device after the write
  bool withholding = false;
  std::int64_t silent_until_ns = 0;  // commands decided before this time are not sent
  Silence silence;
  std::int64_t failing_since_ns = 0;  // no command was confirmed since then; 0: the newest was
};

// Written by the bus thread, read by any.
struct TaskCounters {
  using Counter = std::atomic<std::uint64_t>;
  Counter transactions{0};
  Counter timeouts{0};
  Counter device_exceptions{0};
  Counter invalid_replies{0};
  Counter stale_replies_discarded{0};
  Counter writes{0};
  Counter write_errors{0};
  Counter old_commands_withheld{0};
  std::atomic<bool> connected{false};  // every unit of the task answered last time

  static void add(Counter& counter) noexcept {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
};

constexpr std::int64_t to_ns(double seconds) noexcept {
  return static_cast<std::int64_t>(seconds * 1e9);
}

// Adds the counters of a task to a loop's sum.
void add_to(IoCounters& sum, const TaskCounters& task) noexcept;

struct LinkTask {
  std::string name;  // for events: loop and purpose
  std::int64_t period_ns = 100'000'000;
  bool yields = false;                    // waits if a task without this flag is due
  std::unique_ptr<CommandPoint> command;  // served first
  std::vector<std::unique_ptr<ReadPoint>> reads;
  TaskCounters counters;
  std::atomic<bool> urgent{false};  // serve now, then continue the schedule

  // Bus thread only.
  std::int64_t due_ns = 0;
  std::int64_t retry_ns = 0;      // additional time of service besides due_ns; 0: none
  int retries = 0;                // since the last value or confirmed command
  bool apart = false;             // refused when read singly: never joined with other reads
  bool alone = false;             // next time singly, because a joint read of it has failed
  bool cut_before = false;        // not joined with reads of lower addresses
  int joint_failures = 0;         // consecutive failures of joint reads that would be split here
  std::int64_t cut_until_ns = 0;  // then the joint read is tried again; 0: never
  std::int64_t cut_for_ns = 0;    // how long the next cut lasts

  // Returns the time of its next service.
  std::int64_t next_ns() const noexcept {
    return retry_ns != 0 && retry_ns < due_ns ? retry_ns : due_ns;
  }
};

}  // namespace loopwarden::hal::modbus
