// SPDX-License-Identifier: Apache-2.0
// Reads values and writes commands for the tasks of a link.
#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/modbus/modbus_link.hpp"
#include "hal/modbus/read_batch.hpp"

namespace loopwarden::hal::modbus {
namespace {

// A unit that answers other requests does not support a point that had this many consecutive
// requests without a reply. The point is then read at growing intervals, because each attempt costs
// a response timeout.
constexpr int kFailuresOfSilentPoint = 4;
constexpr std::int64_t kFirstSilentWaitNs = 5'000'000'000;
constexpr std::int64_t kLongestSilentWaitNs = 60'000'000'000;
// A joint read is split after this many failures if each value can be read singly.
constexpr int kJointFailures = 2;
constexpr std::int64_t kFirstCutNs = 60'000'000'000;
constexpr std::int64_t kLongestCutNs = 3'600'000'000'000;
// A failed request is repeated at most this often before the next period, a quarter of a period
// apart.
constexpr int kMostRetries = 3;
constexpr std::int64_t kRetryPart = 4;

const std::string kAnswersOthers = ", although the unit answers other requests. ";
const std::string kCheckRegister = "Check table, address and type of this register.";
const std::string kSpoiled = ", several times in a row. Check the line and the unit.";

std::int64_t silent_wait_ns(int failures) noexcept {
  constexpr int kMostDoublings = 4;
  const int doublings = std::min(failures - kFailuresOfSilentPoint, kMostDoublings);
  return std::min(kFirstSilentWaitNs << doublings, kLongestSilentWaitNs);
}

}  // namespace

void ModbusLink::serve(LinkTask& task) {
  if (task.command) serve_command(task, *task.command);
  for (const auto& point : task.reads) serve_read(task, *point);
  task.alone = false;
  note_connected(task);
}

void ModbusLink::note_connected(LinkTask& task) {
  const bool connected = transport_.connected() || closes_;
  task.counters.connected.store(connected && all_units_answer(task), std::memory_order_relaxed);
}

// Sends one request for all of `tasks`. If it fails, for any reason, each value is read singly in
// this period. One register, or a gap between two, then can't make the others bad.
void ModbusLink::serve_together(std::span<LinkTask* const> tasks) {
  if (tasks.size() == 1) return serve(*tasks.front());
  const std::int64_t asked_ns = BusWaiter::now_ns();
  ReadShape* shape = nullptr;
  {
    const std::lock_guard lock(mutex_);
    shape = &lengths_.joint(joint_shape(tasks), tasks_);
  }
  Reply reply;
  const Asked asked = read(*tasks.front(), *shape, reply);
  if (asked == Asked::exception || asked == Asked::failed) return part(tasks);
  for (LinkTask* task : tasks) {
    ReadPoint& point = *task->reads.front();
    if (asked == Asked::not_asked) note_silence(*task, point);
    if (asked == Asked::valid) {
      const std::size_t from = point.value_read.address - shape->address;
      const auto own = reply.view().subspan(from, point.value_read.needed);
      publish_good(*task, point, decode(point.settings.reg, own), asked_ns);
      task->joint_failures = 0;
      if (!task->cut_before) task->cut_for_ns = 0;
    }
    note_connected(*task);
  }
}

// Reads each of `tasks` singly at once, one at a time, so that commands on the line wait for at
// most one read. A value that is refused or silent in its single read is left out of the next joint
// read. If all single reads succeed, the device refuses the joint read itself: it is split, and
// tried as a whole again later.
void ModbusLink::part(std::span<LinkTask* const> tasks) {
  const std::int64_t now_ns = BusWaiter::now_ns();
  for (LinkTask* task : tasks) {
    task->alone = true;
    task->retry_ns = now_ns;
  }
  LinkTask& upper = *tasks[parting(tasks)];
  if (++upper.joint_failures < kJointFailures) return;
  upper.joint_failures = 0;
  upper.cut_before = true;
  upper.cut_for_ns = std::clamp(2 * upper.cut_for_ns, kFirstCutNs, kLongestCutNs);
  upper.cut_until_ns = now_ns + upper.cut_for_ns;
}

bool ModbusLink::all_units_answer(const LinkTask& task) {
  const bool writes = !task.command || unit_of(task.command->settings.unit).failures == 0;
  return writes && std::all_of(task.reads.begin(), task.reads.end(), [&](const auto& point) {
           return unit_of(point->settings.unit).failures == 0;
         });
}

void ModbusLink::report_error(const LinkTask& task, const std::string& more) {
  report(LinkEvent::Kind::device_error, task.name + ": " + transport_.error() + more, task.name);
}

void ModbusLink::publish_bad(const LinkTask& task, ReadPoint& point, Reason reason,
                             const std::string& more) {
  if (reason == Reason::device_error && point.sample.reason != reason) report_error(task, more);
  point.sample.quality = Quality::bad;
  point.sample.reason = reason;
  point.newest.publish(point.sample);
}

void ModbusLink::publish_good(LinkTask& task, ReadPoint& point, double value,
                              std::int64_t asked_ns) {
  point.silence.failures = 0;
  point.ask_again_ns = 0;
  if (!task.command) task.retries = 0;
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
  if (asked_ns < point.ask_again_ns) return;
  Reply reply;
  const Asked value_asked = read(task, point.value_read, reply);
  // True if refused permanently, or if its single read fails as well after a failed joint read.
  task.apart = refused(value_asked, reply) || (value_asked != Asked::valid && task.apart) ||
               (task.alone && (value_asked == Asked::exception || value_asked == Asked::failed));
  if (value_asked != Asked::valid) {
    task.joint_failures = 0;
    return note_unread(task, point, value_asked, reply);
  }
  const double value = decode(point.settings.reg, reply.view());
  if (point.status_read) {
    if (const Asked asked = read(task, *point.status_read, reply); asked != Asked::valid) {
      return note_unread(task, point, asked, reply);
    }
    const StatusRegister& status = *point.settings.status;
    if ((reply.registers[0] & status.mask) != status.value) {
      return publish_bad(task, point, Reason::sensor_failure);
    }
  }
  publish_good(task, point, value, asked_ns);
}

// A temporary failure keeps the value: its age grows until its reader finds it stale.
void ModbusLink::note_unread(LinkTask& task, ReadPoint& point, Asked asked, const Reply& reply) {
  const Unit& unit = unit_of(point.settings.unit);
  switch (asked) {
    case Asked::exception:
      point.silence.failures = 0;
      if (refused(asked, reply)) return publish_bad(task, point, Reason::device_error);
      retry_soon(task);
      // There is no value yet that could become stale.
      if (point.sample.sequence == 0) return publish_bad(task, point, Reason::device_error);
      return report_error(task, {});
    case Asked::failed:
      if (passes(point.silence, unit)) return retry_soon(task);
      if (is_dead(unit)) return note_silence(task, point);
      // A device is silent for a point that it does not support. An invalid reply is a fault of the
      // line.
      if (spoiled_) {
        if (point.silence.failures == kFailuresOfSilentPoint) report_error(task, kSpoiled);
        return;
      }
      shorten(point.value_read);
      point.ask_again_ns = BusWaiter::now_ns() + silent_wait_ns(point.silence.failures);
      return publish_bad(task, point, Reason::device_error, kAnswersOthers + kCheckRegister);
    case Asked::not_asked: return note_silence(task, point);
    case Asked::stopped:
    case Asked::valid: break;
  }
}

// The unit is silent, or there is no connection: the value is bad once it is too old.
void ModbusLink::note_silence(const LinkTask& task, ReadPoint& point) {
  const std::int64_t age_ns = BusWaiter::now_ns() - point.sample.time_ns;
  const bool fresh = point.sample.quality != Quality::bad && age_ns <= point.settings.max_age_ns;
  if (!fresh) publish_bad(task, point, Reason::link_lost);
}

// Counts a request without a valid reply. Returns true if the next one may succeed: the unit is not
// dead, and this point is not the only one that fails.
bool ModbusLink::passes(Silence& silence, const Unit& unit) noexcept {
  const bool answers_others = std::exchange(silence.unit_answers, unit.answers) != unit.answers;
  silence.failures = silence.failures == 0 || answers_others ? silence.failures + 1 : 1;
  return !is_dead(unit) && silence.failures < kFailuresOfSilentPoint;
}

void ModbusLink::retry_soon(LinkTask& task) noexcept {
  if (task.retries >= kMostRetries) return;
  ++task.retries;
  task.retry_ns = BusWaiter::now_ns() + task.period_ns / kRetryPart;
}

// Handles a command that was not confirmed. It is repeated. The output counts as lost after
// `tolerated_ns` without a confirmation.
void ModbusLink::note_unwritten(LinkTask& task, CommandPoint& point, Reason reason,
                                std::int64_t tolerated_ns) {
  TaskCounters::add(task.counters.write_errors);
  const std::int64_t now_ns = BusWaiter::now_ns();
  if (point.failing_since_ns == 0) point.failing_since_ns = now_ns;
  const std::int64_t since_ns =
      point.output.ok ? point.output.confirmed_ns : point.failing_since_ns;
  const bool undecided = point.output.ok || point.output.reason == Reason::never_received;
  if (undecided && now_ns - since_ns < tolerated_ns) return retry_soon(task);
  point.output.ok = false;
  point.output.reason = reason;
  point.state.publish(point.output);
}

void ModbusLink::serve_command(LinkTask& task, CommandPoint& point) {
  const PointSettings& settings = point.settings;
  if (const BusCommand& command = point.newest.newest(); command.id == 0 || !command.write) {
    // A pause that the loop requests does not count as silence of the bus.
    point.output.confirmed_ns = BusWaiter::now_ns();
    point.failing_since_ns = 0;
    return;
  }
  Reply reply;
  const auto failed = [&](Asked asked, std::uint8_t unit) {
    const std::int64_t longest_ns = point.longest_silence_ns;
    if (asked == Asked::exception) {
      const bool passes = is_transient(reply.exception);
      return note_unwritten(task, point, Reason::device_error, passes ? longest_ns : 0);
    }
    const bool silent = asked != Asked::failed || is_dead(unit_of(unit));
    note_unwritten(task, point, Reason::link_lost,
                   silent ? std::min(longest_ns, settings.max_age_ns) : longest_ns);
  };
  if (point.watchdog) {
    const Asked armed = ensure_watchdog(task, point, reply);
    if (armed != Asked::valid) return failed(armed, point.watchdog->point.unit);
  }
  if (!ready(task, {settings.unit, ReadFunction::holding_registers, settings.reg.address})) {
    return failed(Asked::not_asked, settings.unit);
  }
  // ready() may find that the device restarted. Its watchdog must then be set first, next time.
  if (point.watchdog && point.armed_epoch != unit_of(point.watchdog->point.unit).epoch) {
    return note_unwritten(task, point, Reason::link_lost, point.longest_silence_ns);
  }

  // The command is fetched only now, because the steps above may take long.
  const BusCommand command = point.newest.newest();
  if (BusWaiter::now_ns() - command.time_ns > point.max_age_ns) {
    TaskCounters::add(task.counters.old_commands_withheld);
    if (!std::exchange(point.withholding, true)) {
      report(
          LinkEvent::Kind::commands_withheld,
          task.name + ": the loop no longer renews its command. The device's own watchdog must act",
          task.name);
    }
    point.output.ok = false;
    point.output.reason = Reason::stale;
    return point.state.publish(point.output);
  }
  point.withholding = false;
  const std::int64_t sent_ns = BusWaiter::now_ns();
  if (point.output.ok && sent_ns - point.output.confirmed_ns > point.longest_silence_ns) {
    // The device's watchdog may have moved the valve. The loop must see the loss before its next
    // command is sent.
    point.silent_until_ns = sent_ns;
    return note_unwritten(task, point, Reason::link_lost, 0);
  }
  if (command.time_ns <= point.silent_until_ns) return;
  Registers registers;
  if (!command.write || encode(settings.reg, command.value, registers) == EncodeResult::refused) {
    return;
  }
  const Request request = write_request(settings.unit, settings.reg.write_function,
                                        settings.reg.address, registers.view());
  const Asked asked = exchange(task, request, reply, Purpose::value);
  if (asked == Asked::stopped) return;
  if (asked != Asked::valid) {
    const Unit& unit = unit_of(settings.unit);
    const bool ignored = asked == Asked::failed && !passes(point.silence, unit) && !is_dead(unit);
    if (ignored) report_error(task, kAnswersOthers + write_function_hint(request));
    const bool news = point.output.reason != Reason::device_error;
    if (asked == Asked::exception && news) report_error(task, {});
    return failed(asked, settings.unit);
  }
  TaskCounters::add(task.counters.writes);
  task.retries = 0;
  point.silence.failures = 0;
  point.failing_since_ns = 0;
  point.output = {
      .ok = true, .reason = Reason::none, .written_id = command.id, .confirmed_ns = sent_ns};
  point.state.publish(point.output);
}

// Returns valid if the device's communication watchdog is set, so that commands may be sent.
ModbusLink::Asked ModbusLink::ensure_watchdog(LinkTask& task, CommandPoint& point, Reply& reply) {
  if (!ensure_connected()) return Asked::not_asked;
  const Unit& unit = unit_of(point.watchdog->point.unit);
  const bool armed = point.armed_epoch == unit.epoch && unit.failures == 0;
  if (armed && !watchdog_forgotten(task, point)) return Asked::valid;
  return set_watchdog(task, point, reply);
}

ModbusLink::Asked ModbusLink::set_watchdog(LinkTask& task, CommandPoint& point, Reply& reply) {
  const PointSettings& settings = point.watchdog->point;
  Registers registers;
  if (encode(settings.reg, point.watchdog->value, registers) == EncodeResult::refused) {
    return Asked::not_asked;
  }
  const Request write = write_request(settings.unit, settings.reg.write_function,
                                      settings.reg.address, registers.view());
  Registers& held = point.watchdog_held;
  // Some devices round the written value. Only a different value in two attempts counts as
  // rounding, because the device may have restarted between the write and one read.
  constexpr int kAttempts = 2;
  for (int attempt = 0; attempt < kAttempts && (attempt == 0 || held.words != registers.words);
       ++attempt) {
    const Asked asked = ask(task, write, reply);
    if (asked != Asked::valid) {
      if (asked == Asked::exception && point.output.reason != Reason::device_error) {
        report(
            LinkEvent::Kind::watchdog_refused,
            task.name + ": no command is sent without the device's watchdog: " + transport_.error(),
            task.name);
      }
      return asked;
    }
    point.armed_epoch = unit_of(settings.unit).epoch;
    held = {};
    if (read(task, *point.watchdog_read, reply) != Asked::valid) break;
    held.count = registers.count;
    std::copy_n(reply.registers.begin(), held.count, held.words.begin());
  }
  point.watchdog_check_ns = BusWaiter::now_ns() + to_ns(point.watchdog->check_interval_s);
  report(LinkEvent::Kind::watchdog_set, task.name + ": the device's watchdog is set", task.name);
  return Asked::valid;
}

bool ModbusLink::watchdog_forgotten(LinkTask& task, CommandPoint& point) {
  if (point.watchdog_held.count == 0 || BusWaiter::now_ns() < point.watchdog_check_ns) return false;
  point.watchdog_check_ns = BusWaiter::now_ns() + to_ns(point.watchdog->check_interval_s);
  Reply reply;
  if (read(task, *point.watchdog_read, reply) != Asked::valid) return false;
  const auto held = point.watchdog_held.view();
  if (std::equal(held.begin(), held.end(), reply.registers.begin())) return false;
  report(LinkEvent::Kind::watchdog_lost, task.name + ": the device has lost its watchdog setting",
         task.name);
  return true;
}

}  // namespace loopwarden::hal::modbus
