// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_link.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "base/clock.hpp"
#include "hal/modbus/read_batch.hpp"

namespace loopwarden::hal::modbus {
namespace {

using base::kNanosecondsPerSecond;

constexpr std::int64_t kIdleNs = kNanosecondsPerSecond;
constexpr std::uint16_t kMostExtraRegisters = 8;  // of bits: so many bytes
constexpr std::uint16_t kBitsAByte = 8;
constexpr double kFirstProbeSeconds = 0.5;
// A unit that never answers barriers may just ignore requests it does not like. After so long
// without a request or a byte from it, nothing older can be on its way.
constexpr std::int64_t kSettledNs = 10 * kNanosecondsPerSecond;

constexpr std::uint8_t kIllegalAddress = 2;
constexpr std::uint8_t kIllegalValue = 3;

template <class Visit>
void for_each_shape(LinkTask& task, Visit visit) {
  if (task.command && task.command->watchdog_read) visit(*task.command->watchdog_read);
  for (const auto& point : task.reads) {
    visit(point->value_read);
    if (point->status_read) visit(*point->status_read);
  }
}

// Whether the replies to both look alike.
bool same_length(const ReadShape& shape, std::uint8_t unit, ReadFunction function,
                 std::uint16_t count) noexcept {
  return shape.unit == unit && shape.function == function &&
         reply_bytes(function, shape.count) == reply_bytes(function, count);
}

std::int64_t to_ns(double seconds) noexcept {
  return static_cast<std::int64_t>(seconds * static_cast<double>(kNanosecondsPerSecond));
}

std::string unit_text(std::uint8_t unit) { return "unit " + std::to_string(unit); }

}  // namespace

ModbusLink::ModbusLink(LinkSettings settings, EventSink sink)
    : settings_(std::move(settings)),
      sink_(std::move(sink)),
      transport_(settings_, waiter_),
      jitter_(std::random_device{}()) {
  // A bus thread that is refused nothing but ordinary scheduling has nothing to say.
  base::ThreadOptions options;
  options.name = "mb " + settings_.name;
  (void)thread_.start(options, [this] { run(); });
}

ModbusLink::~ModbusLink() {
  waiter_.stop();
  thread_.join();
}

// --- tasks -------------------------------------------------------------------------------------

void ModbusLink::attach(LinkTask& task) {
  {
    const std::lock_guard lock(mutex_);
    if (!is_tcp()) choose_lengths(task);
    task.due_ns = BusWaiter::now_ns();
    // Watched loops of one period in one phase, whenever they came, so that one request can serve them.
    if (task.yields) task.due_ns -= task.due_ns % task.period_ns;
    task.merges = true;
    if (task.command) task.command->armed_epoch = 0;  // of another link's numbering
    tasks_.push_back(&task);
  }
  waiter_.interrupt();
}

void ModbusLink::detach(LinkTask& task) noexcept {
  std::unique_lock lock(mutex_);
  std::erase(tasks_, &task);
  served_.wait(lock, [&] {
    return std::find(in_service_.begin(), in_service_.end(), &task) == in_service_.end();
  });
}

void ModbusLink::serve_soon(LinkTask& task) noexcept {
  task.urgent.store(true, std::memory_order_release);
  waiter_.interrupt();
}

void ModbusLink::choose_lengths(LinkTask& task) {
  std::vector<ReadShape*> chosen;
  for_each_shape(task, [&](ReadShape& shape) {
    const auto taken = [&](std::uint16_t count) {
      return length_taken(shape.unit, shape.function, count) ||
             std::any_of(chosen.begin(), chosen.end(), [&](const ReadShape* other) {
               return same_length(*other, shape.unit, shape.function, count);
             });
    };
    const std::uint16_t step = reads_bits(shape.function) ? kBitsAByte : 1;
    std::uint16_t count = shape.needed;
    while (taken(count) && count < shape.needed + step * kMostExtraRegisters) count += step;
    const bool fits = shape.address + count <= 0x10000;
    shape.count = fits && !taken(count) ? count : shape.needed;
    chosen.push_back(&shape);
  });
}

bool ModbusLink::length_taken(std::uint8_t unit, ReadFunction function, std::uint16_t count) const {
  bool taken = false;
  for (LinkTask* task : tasks_) {
    for_each_shape(
        *task, [&](const ReadShape& shape) { taken |= same_length(shape, unit, function, count); });
  }
  return taken;
}

bool ModbusLink::take_due_tasks(std::int64_t now_ns, std::int64_t& next_ns) {
  const std::lock_guard lock(mutex_);
  next_ns = now_ns + kIdleNs;
  LinkTask* first = nullptr;
  for (LinkTask* task : tasks_) {
    if (task->urgent.exchange(false, std::memory_order_acquire)) {
      forget_back_off();
      in_service_.assign(1, task);
      return true;
    }
    next_ns = std::min(next_ns, task->due_ns);
    if (task->due_ns > now_ns) continue;
    const auto rank = [](const LinkTask& due) { return std::pair(due.yields, due.due_ns); };
    if (first == nullptr || rank(*task) < rank(*first)) first = task;
  }
  if (first == nullptr) return false;
  // On a serial line, where the length of a reply tells what it answers, each read stays as it is.
  if (is_tcp()) {
    together_ = gather(*first, tasks_, now_ns, in_service_);
  } else {
    in_service_.assign(1, first);
  }
  // Periods that have passed meanwhile are left out; the phase stays.
  for (LinkTask* task : in_service_) {
    task->due_ns +=
        (std::max<std::int64_t>(now_ns - task->due_ns, 0) / task->period_ns + 1) * task->period_ns;
  }
  return true;
}

void ModbusLink::forget_back_off() {
  reconnect_at_ns_ = 0;
  for (auto& [id, unit] : units_) unit.retry_at_ns = 0;
}

void ModbusLink::give_back() {
  {
    const std::lock_guard lock(mutex_);
    in_service_.clear();
  }
  served_.notify_all();
}

void ModbusLink::run() {
  while (!waiter_.stopping()) {
    try {
      std::int64_t next_ns = 0;
      if (!take_due_tasks(BusWaiter::now_ns(), next_ns)) {
        (void)waiter_.wait_until(next_ns);
        continue;
      }
      if (in_service_.size() > 1) {
        serve_together();
      } else {
        serve(*in_service_.front());
      }
    } catch (const std::exception&) {
      // Memory that can't be had. The samples grow old by themselves; the line begins afresh.
      transport_.disconnect();
    }
    give_back();
  }
  transport_.disconnect();
}

// --- points ------------------------------------------------------------------------------------

void ModbusLink::serve(LinkTask& task) {
  if (task.command) serve_command(task, *task.command);
  for (const auto& point : task.reads) serve_read(task, *point);
  note_connected(task);
}

void ModbusLink::note_connected(LinkTask& task) {
  task.counters.connected.store(transport_.connected() && all_units_answer(task),
                                std::memory_order_relaxed);
}

// One request for all tasks in service. A device that has no register in one of the gaps refuses it all: then each is
// asked for by itself, now and from now on.
void ModbusLink::serve_together() {
  const std::int64_t asked_ns = BusWaiter::now_ns();
  Reply reply;
  const Asked asked = read(*in_service_.front(), together_, reply);
  const bool not_there = asked == Asked::exception &&
                         (reply.exception == kIllegalAddress || reply.exception == kIllegalValue);
  for (LinkTask* task : in_service_) {
    ReadPoint& point = *task->reads.front();
    if (not_there) {
      task->merges = false;
      serve_read(*task, point);
    } else if (asked != Asked::valid) {
      publish_bad(*task, point, reason_of(asked));
    } else {
      const std::size_t from = point.value_read.address - together_.address;
      const auto own = reply.view().subspan(from, point.value_read.needed);
      publish_good(*task, point, decode(point.settings.reg, own), asked_ns);
    }
    note_connected(*task);
  }
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
  if (const Asked asked = read(task, point.value_read, reply); asked != Asked::valid) {
    return publish_bad(task, point, reason_of(asked));
  }
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

  if (const BusCommand& command = point.newest.newest(); command.id == 0 || !command.write) return;
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

// --- requests ----------------------------------------------------------------------------------

ModbusLink::Unit& ModbusLink::unit_of(std::uint8_t id) {
  const auto [entry, fresh] = units_.try_emplace(id);
  if (fresh) {
    entry->second.epoch = ++epochs_;
    entry->second.barrier_needed = !is_tcp();
  }
  return entry->second;
}

bool ModbusLink::ensure_connected() {
  if (transport_.connected()) return true;
  if (waiter_.stopping() || BusWaiter::now_ns() < reconnect_at_ns_) return false;
  if (!transport_.connect()) {
    note_lost_connection();
    return false;
  }
  if (std::exchange(opened_before_, true)) {
    reconnects_.store(reconnects_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  for (auto& [id, unit] : units_) {
    unit.epoch = ++epochs_;
    unit.barrier_needed = !is_tcp();
  }
  if (!is_tcp()) {
    working_ = true;
    failure_reported_ = false;
    report(LinkEvent::Kind::connected, "serial line open");
  }
  return true;
}

// Connected, nothing unasked on the line, and the unit due to be asked.
bool ModbusLink::ready(LinkTask& task, const Target& target) {
  if (!ensure_connected()) return false;
  discard_unasked(task);
  if (!transport_.connected()) {
    note_lost_connection();
    if (!ensure_connected()) return false;
  }
  const Unit& unit = unit_of(target.unit);
  if (BusWaiter::now_ns() < unit.retry_at_ns) return false;
  // A line that repeats the barrier's reply as well needs another one.
  constexpr int kBarriers = 3;
  for (int i = 0; i < kBarriers && unit.barrier_needed; ++i) {
    if (!pass_barrier(task, target)) return false;
    discard_unasked(task);
  }
  return transport_.connected() && !unit.barrier_needed;
}

void ModbusLink::discard_unasked(LinkTask& task) {
  if (transport_.discard_unasked() == 0) return;
  TaskCounters::add(task.counters.stale_replies_discarded);
  if (last_asked_) unit_of(*last_asked_).barrier_needed = !is_tcp();
}

ModbusLink::Asked ModbusLink::ask(LinkTask& task, const Request& request, Reply& reply) {
  const ReadFunction function = request.read.value_or(ReadFunction::holding_registers);
  if (!ready(task, {request.unit, function, request.address})) return Asked::failed;
  return exchange(task, request, reply, Purpose::value);
}

ModbusLink::Asked ModbusLink::read(LinkTask& task, ReadShape& shape, Reply& reply) {
  const auto request = [&] {
    return read_request(shape.unit, shape.function, shape.address, shape.count);
  };
  const Asked asked = ask(task, request(), reply);
  const bool too_long = asked == Asked::exception && shape.count > shape.needed &&
                        (reply.exception == kIllegalAddress || reply.exception == kIllegalValue);
  if (!too_long) return asked;
  {
    const std::lock_guard lock(mutex_);  // attach() looks at the lengths of all tasks
    shape.count = shape.needed;
  }
  return ask(task, request(), reply);
}

bool ModbusLink::pass_barrier(LinkTask& task, const Target& target) {
  std::uint16_t count = 1;
  {
    const std::lock_guard lock(mutex_);
    const std::uint16_t step = reads_bits(target.function) ? kBitsAByte : 1;
    while (length_taken(target.unit, target.function, count) && count + step <= kMaxReadRegisters) {
      count += step;
    }
  }
  const int address = std::min<int>(target.address, 0x10000 - count);
  const Request barrier =
      read_request(target.unit, target.function, static_cast<std::uint16_t>(address), count);
  Reply reply;
  const bool answered = exchange(task, barrier, reply, Purpose::barrier) != Asked::failed;
  Unit& unit = unit_of(target.unit);
  if (answered || BusWaiter::now_ns() - unit.unsettled_ns > kSettledNs) unit.barrier_needed = false;
  return answered;
}

ModbusLink::Asked ModbusLink::exchange(LinkTask& task, const Request& request, Reply& reply,
                                       Purpose purpose) {
  TaskCounters& counters = task.counters;
  TaskCounters::add(counters.transactions);
  const bool was_silent = unit_of(request.unit).failures > 0;
  const auto settle = was_silent ? ModbusTransport::Settle::brief : ModbusTransport::Settle::full;
  last_asked_ = request.unit;
  const Outcome outcome = transport_.exchange(request, reply, settle);
  if (transport_.drained_bytes() > 0) TaskCounters::add(counters.stale_replies_discarded);
  if (purpose == Purpose::value || outcome == Outcome::invalid || transport_.drained_bytes() > 0) {
    unit_of(request.unit).unsettled_ns = BusWaiter::now_ns();
  }
  switch (outcome) {
    case Outcome::valid: note_answer(request); return Asked::valid;
    case Outcome::exception:
      // A barrier may well ask for what the device does not have.
      if (purpose == Purpose::value) TaskCounters::add(counters.device_exceptions);
      note_answer(request);
      return Asked::exception;
    case Outcome::timeout: TaskCounters::add(counters.timeouts); break;
    case Outcome::invalid: TaskCounters::add(counters.invalid_replies); break;
    case Outcome::stopped: return Asked::failed;
    case Outcome::disconnected: break;
  }
  note_failure(request);
  return Asked::failed;
}

void ModbusLink::note_answer(const Request& request) {
  Unit& unit = unit_of(request.unit);
  if (std::exchange(unit.failures, 0) > 0) unit.epoch = ++epochs_;
  unit.retry_at_ns = 0;
  if (std::exchange(unit.silence_reported, false)) {
    report(LinkEvent::Kind::unit_back, unit_text(request.unit) + " answers again");
  }
  connection_failures_ = 0;
  failure_reported_ = false;
  if (!std::exchange(working_, true)) report(LinkEvent::Kind::connected, "connected");
}

void ModbusLink::note_failure(const Request& request) {
  Unit& unit = unit_of(request.unit);
  ++unit.failures;
  if (!transport_.connected()) note_lost_connection();
  if (is_tcp()) return;
  unit.barrier_needed = true;
  if (unit.failures < 2) return;
  unit.retry_at_ns = BusWaiter::now_ns() +
                     back_off_ns(unit.failures - 2, kFirstProbeSeconds, settings_.probe_interval_s);
  if (!std::exchange(unit.silence_reported, true)) {
    report(LinkEvent::Kind::unit_silent, unit_text(request.unit) + ": " + transport_.error());
  }
}

// At once after the first failure, then ever more rarely.
void ModbusLink::note_lost_connection() {
  const int failures = ++connection_failures_;
  reconnect_at_ns_ = BusWaiter::now_ns();
  if (failures > 1) {
    reconnect_at_ns_ +=
        back_off_ns(failures - 2, settings_.reconnect_min_s, settings_.reconnect_max_s);
  }
  const bool was_working = std::exchange(working_, false);
  if (!std::exchange(failure_reported_, true)) {
    report(was_working ? LinkEvent::Kind::disconnected : LinkEvent::Kind::connect_failed,
           transport_.error());
  }
}

std::int64_t ModbusLink::back_off_ns(int doublings, double first_s, double longest_s) {
  const double wait_s = std::min(first_s * std::exp2(std::min(doublings, 30)), longest_s);
  std::uniform_real_distribution<double> spread(0.8, 1.2);
  return to_ns(wait_s * spread(jitter_));
}

void ModbusLink::report(LinkEvent::Kind kind, std::string text) const {
  if (sink_) sink_({kind, settings_.name, std::move(text)});
}

}  // namespace loopwarden::hal::modbus
