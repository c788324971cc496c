// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/link_task.hpp"

namespace loopwarden::hal::modbus {
namespace {

ReadShape value_shape(const PointSettings& point) noexcept {
  const auto count = register_count(point.reg.type);
  return {point.unit, read_function(point.reg.table), point.reg.address, count, count};
}

}  // namespace

void add_to(IoCounters& sum, const TaskCounters& task) noexcept {
  const auto get = [](const TaskCounters::Counter& counter) {
    return counter.load(std::memory_order_relaxed);
  };
  sum.transactions += get(task.transactions);
  sum.timeouts += get(task.timeouts);
  sum.device_exceptions += get(task.device_exceptions);
  sum.invalid_replies += get(task.invalid_replies);
  sum.stale_replies_discarded += get(task.stale_replies_discarded);
  sum.writes += get(task.writes);
  sum.write_errors += get(task.write_errors);
  sum.old_commands_withheld += get(task.old_commands_withheld);
}

ReadPoint::ReadPoint(const PointSettings& point) : settings(point), value_read(value_shape(point)) {
  if (point.status) {
    status_read =
        ReadShape{point.unit, read_function(point.status->table), point.status->address, 1, 1};
  }
}

CommandPoint::CommandPoint(const PointSettings& point, std::int64_t maximum_age_ns,
                           std::int64_t silence_ns, const CommLossSettings& comm_loss)
    : settings(point),
      max_age_ns(maximum_age_ns),
      longest_silence_ns(silence_ns),
      watchdog(comm_loss.watchdog) {
  if (watchdog) watchdog_read = value_shape(watchdog->point);
}

}  // namespace loopwarden::hal::modbus
