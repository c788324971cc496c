// SPDX-License-Identifier: Apache-2.0
// What a link does for its tasks: values that are read, commands that are written.
#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/modbus/modbus_link.hpp"
#include "hal/modbus/read_batch.hpp"

namespace loopwarden::hal::modbus {

void ModbusLink::serve(LinkTask& task) {
  if (task.command) serve_command(task, *task.command);
  for (const auto& point : task.reads) serve_read(task, *point);
  note_connected(task);
}

void ModbusLink::note_connected(LinkTask& task) {
  task.counters.connected.store(transport_.connected() && all_units_answer(task),
                                std::memory_order_relaxed);
}

// One request for all of `tasks`. A device that refuses it has no register at one of the addresses, or in a gap: then
// each half is asked for, down to what is refused by itself, now and from now on. True if nothing was parted.
bool ModbusLink::serve_together(std::span<LinkTask* const> tasks) {
  if (tasks.size() == 1) {
    serve(*tasks.front());
    return !tasks.front()->apart && all_units_answer(*tasks.front());
  }
  const std::int64_t asked_ns = BusWaiter::now_ns();
  ReadShape* shape = nullptr;
  {
    const std::lock_guard lock(mutex_);
    shape = &lengths_.joint(joint_shape(tasks), tasks_);
  }
  Reply reply;
  const Asked asked = read(*tasks.front(), *shape, reply);
  if (not_there(asked, reply)) {
    const std::size_t at = parting(tasks);
    const bool lower = serve_together(tasks.first(at));
    const bool upper = serve_together(tasks.subspan(at));
    if (lower && upper) tasks[at]->cut_before = true;
    return false;
  }
  for (LinkTask* task : tasks) {
    ReadPoint& point = *task->reads.front();
    if (asked != Asked::valid) {
      publish_bad(*task, point, reason_of(asked));
    } else {
      const std::size_t from = point.value_read.address - shape->address;
      const auto own = reply.view().subspan(from, point.value_read.needed);
      publish_good(*task, point, decode(point.settings.reg, own), asked_ns);
    }
    note_connected(*task);
  }
  return asked == Asked::valid;
}

bool ModbusLink::all_units_answer(const LinkTask& task) {
  const bool writes = !task.command || unit_of(task.command->settings.unit).failures == 0;
  return writes && std::all_of(task.reads.begin(), task.reads.end(), [&](const auto& point) {
           return unit_of(point->settings.unit).failures == 0;
         });
}

Reason ModbusLink::reason_of(Asked asked) noexcept {
  return asked == Asked::exception ? Reason::device_error : Reason::link_lost;
}

void ModbusLink::publish_bad(const LinkTask& task, ReadPoint& point, Reason reason) {
  if (reason == Reason::device_error && point.sample.reason != reason) {
    report(LinkEvent::Kind::device_error, task.name + ": " + transport_.error());
  }
  point.sample.quality = Quality::bad;
  point.sample.reason = reason;
  point.newest.publish(point.sample);
}

void ModbusLink::publish_good(const LinkTask& task, ReadPoint& point, double value,
                              std::int64_t asked_ns) {
  if (!std::isfinite(value)) return publish_bad(task, point, Reason::not_finite);
  point.sample = {.value = value,
                  .time_ns = asked_ns,
                  .sequence = point.sample.sequence + 1,
                  .quality = Quality::good,
                  .reason = Reason::none};
  point.newest.publish(point.sample);
}

void ModbusLink::serve_read(LinkTask& task, ReadPoint& point) {
  const std::int64_t asked_ns = BusWaiter::now_ns();  // the value is no older than this
  Reply reply;
  const Asked value_asked = read(task, point.value_read, reply);
  task.apart = value_asked == Asked::exception || (task.apart && value_asked == Asked::failed);
  if (value_asked != Asked::valid) return publish_bad(task, point, reason_of(value_asked));
  const double value = decode(point.settings.reg, reply.view());
  if (point.status_read) {
    if (const Asked asked = read(task, *point.status_read, reply); asked != Asked::valid) {
      return publish_bad(task, point, reason_of(asked));
    }
    const StatusRegister& status = *point.settings.status;
    if ((reply.registers[0] & status.mask) != status.value) {
      return publish_bad(task, point, Reason::sensor_failure);
    }
  }
  publish_good(task, point, value, asked_ns);
}

void ModbusLink::serve_command(LinkTask& task, CommandPoint& point) {
  const auto publish = [&](bool ok, Reason reason) {
    if (reason == Reason::device_error && point.output.reason != reason) {
      report(LinkEvent::Kind::device_error, task.name + ": " + transport_.error());
    }
    point.output.ok = ok;
    point.output.reason = reason;
    point.state.publish(point.output);
  };

  if (const BusCommand& command = point.newest.newest(); command.id == 0 || !command.write) {
    // A silence that the loop asks for is no silence of the bus.
    point.output.confirmed_ns = BusWaiter::now_ns();
    return;
  }
  if (point.watchdog && !ensure_watchdog(task, point)) {
    TaskCounters::add(task.counters.write_errors);
    const bool refused =
        transport_.connected() && unit_of(point.watchdog->point.unit).failures == 0;
    return publish(false, refused ? Reason::device_error : Reason::link_lost);
  }
  const PointSettings& settings = point.settings;
  // Getting ready may find that the device restarted: then its watchdog comes first, next time.
  if (!ready(task, {settings.unit, ReadFunction::holding_registers, settings.reg.address}) ||
      (point.watchdog && point.armed_epoch != unit_of(point.watchdog->point.unit).epoch)) {
    TaskCounters::add(task.counters.write_errors);
    return publish(false, Reason::link_lost);
  }

  // Looked at only now, since all of the above may have taken its time.
  const BusCommand command = point.newest.newest();
  if (BusWaiter::now_ns() - command.time_ns > point.max_age_ns) {
    TaskCounters::add(task.counters.old_commands_withheld);
    if (!std::exchange(point.withholding, true)) {
      report(LinkEvent::Kind::commands_withheld,
             task.name + ": the loop no longer renews its command, which is left to the device");
    }
    return publish(false, Reason::stale);
  }
  point.withholding = false;
  const std::int64_t sent_ns = BusWaiter::now_ns();
  if (point.output.ok && sent_ns - point.output.confirmed_ns > point.longest_silence_ns) {
    // The device may have moved the valve meanwhile. The loop is told before it is obeyed.
    point.silent_until_ns = sent_ns;
    TaskCounters::add(task.counters.write_errors);
    return publish(false, Reason::link_lost);
  }
  if (command.time_ns <= point.silent_until_ns) return;
  Registers registers;
  if (!command.write || encode(settings.reg, command.value, registers) == EncodeResult::refused) {
    return;
  }
  Reply reply;
  const Asked asked = exchange(task,
                               write_request(settings.unit, settings.reg.write_function,
                                             settings.reg.address, registers.view()),
                               reply, Purpose::value);
  if (asked == Asked::valid) {
    TaskCounters::add(task.counters.writes);
    point.output.written_id = command.id;
    point.output.confirmed_ns = sent_ns;
    return publish(true, Reason::none);
  }
  TaskCounters::add(task.counters.write_errors);
  publish(false, asked == Asked::exception ? Reason::device_error : Reason::link_lost);
}

// True if the device has its communication watchdog set, so that commands may go out.
bool ModbusLink::ensure_watchdog(LinkTask& task, CommandPoint& point) {
  if (!ensure_connected()) return false;
  const Unit& unit = unit_of(point.watchdog->point.unit);
  const bool armed = point.armed_epoch == unit.epoch && unit.failures == 0;
  if (armed && !watchdog_forgotten(task, point)) return true;
  return set_watchdog(task, point);
}

bool ModbusLink::set_watchdog(LinkTask& task, CommandPoint& point) {
  const PointSettings& settings = point.watchdog->point;
  Registers registers;
  if (encode(settings.reg, point.watchdog->value, registers) == EncodeResult::refused) return false;
  const Request write = write_request(settings.unit, settings.reg.write_function,
                                      settings.reg.address, registers.view());
  Registers& held = point.watchdog_held;
  // Some devices round what they are given. Only one that holds something else twice over does so;
  // once, it may just have restarted in between.
  constexpr int kAttempts = 2;
  for (int attempt = 0; attempt < kAttempts && (attempt == 0 || held.words != registers.words);
       ++attempt) {
    Reply reply;
    const Asked asked = ask(task, write, reply);
    if (asked != Asked::valid) {
      if (asked == Asked::exception && point.output.reason != Reason::device_error) {
        report(LinkEvent::Kind::watchdog_refused,
               task.name +
                   ": no command is sent without the device's watchdog: " + transport_.error());
      }
      return false;
    }
    point.armed_epoch = unit_of(settings.unit).epoch;
    held = {};
    if (read(task, *point.watchdog_read, reply) != Asked::valid) break;
    held.count = registers.count;
    std::copy_n(reply.registers.begin(), held.count, held.words.begin());
  }
  point.watchdog_check_ns = BusWaiter::now_ns() + to_ns(point.watchdog->check_interval_s);
  report(LinkEvent::Kind::watchdog_set, task.name + ": the device's watchdog is set");
  return true;
}

bool ModbusLink::watchdog_forgotten(LinkTask& task, CommandPoint& point) {
  if (point.watchdog_held.count == 0 || BusWaiter::now_ns() < point.watchdog_check_ns) return false;
  point.watchdog_check_ns = BusWaiter::now_ns() + to_ns(point.watchdog->check_interval_s);
  Reply reply;
  if (read(task, *point.watchdog_read, reply) != Asked::valid) return false;
  const auto held = point.watchdog_held.view();
  if (std::equal(held.begin(), held.end(), reply.registers.begin())) return false;
  report(LinkEvent::Kind::watchdog_lost, task.name + ": the device has lost its watchdog setting");
  return true;
}

}  // namespace loopwarden::hal::modbus
