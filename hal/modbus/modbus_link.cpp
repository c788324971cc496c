// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_link.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "base/clock.hpp"
#include "hal/modbus/line_time.hpp"
#include "hal/modbus/read_batch.hpp"

namespace loopwarden::hal::modbus {
namespace {

using base::kNanosecondsPerSecond;

constexpr std::int64_t kIdleNs = kNanosecondsPerSecond;
constexpr double kFirstProbeSeconds = 0.5;
// A unit that never answers barriers may ignore requests that it does not support. After this time
// without a request or a byte from the unit, no older reply can still arrive.
constexpr std::int64_t kSettledNs = 10 * kNanosecondsPerSecond;

std::string unit_text(std::uint8_t unit) { return "unit " + std::to_string(unit); }

}  // namespace

ModbusLink::ModbusLink(LinkSettings settings, EventSink sink)
    : settings_(std::move(settings)),
      sink_(std::move(sink)),
      lengths_(settings_.transport == Transport::rtu),
      transport_(settings_, waiter_),
      jitter_(std::random_device{}()) {
  // A bus thread requests only ordinary scheduling, so the system has no request to refuse.
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
    lengths_.choose(task, tasks_);
    task.due_ns = BusWaiter::now_ns();
    // Watched loops of one period share one phase, whenever they were attached, so that one request
    // can serve them.
    if (task.yields) task.due_ns -= task.due_ns % task.period_ns;
    task.apart = task.alone = task.cut_before = false;
    task.retry_ns = 0;
    if (task.command)
      task.command->armed_epoch = 0;  // an epoch of another link has no meaning
                                      // here
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
    if (task->cut_until_ns != 0 && now_ns >= task->cut_until_ns) {
      task->cut_before = false;
      task->cut_until_ns = 0;
    }
    next_ns = std::min(next_ns, task->next_ns());
    if (task->next_ns() > now_ns) continue;
    const auto rank = [](const LinkTask& due) { return std::pair(due.yields, due.next_ns()); };
    if (first == nullptr || rank(*task) < rank(*first)) first = task;
  }
  if (first == nullptr) return false;
  gather(*first, tasks_, now_ns, most_together(), in_service_);
  for (LinkTask* task : in_service_) {
    const bool retried = std::exchange(task->retry_ns, 0) != 0;
    if (retried && task->due_ns > now_ns) continue;
    // Missed periods are skipped; the phase stays.
    task->due_ns +=
        (std::max<std::int64_t>(now_ns - task->due_ns, 0) / task->period_ns + 1) * task->period_ns;
  }
  return true;
}

int ModbusLink::most_together() const {
  if (is_tcp()) return static_cast<int>(kMaxReadRegisters);
  double shortest_s = std::numeric_limits<double>::infinity();
  for (const LinkTask* task : tasks_) {
    if (!task->yields)
      shortest_s = std::min(shortest_s, static_cast<double>(task->period_ns) / 1e9);
  }
  return most_registers_together(settings_, shortest_s);
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
      serve_together(in_service_);
    } catch (const std::exception&) {
      // Out of memory. The samples become stale by their age; the connection starts again.
      transport_.disconnect();
    }
    give_back();
  }
  transport_.disconnect();
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
  const bool was_closed = transport_.closed_by_device();
  const std::size_t replies = transport_.replies();
  if (!transport_.connect()) {
    closings_ = 0;
    closes_ = false;
    note_lost_connection();
    return false;
  }
  if (was_closed && replies > 0) note_closing(replies);
  if (std::exchange(opened_before_, true) && !closes_) {
    reconnects_.store(reconnects_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // A device that regularly closes its connections has not restarted.
  for (auto& [id, unit] : units_) {
    if (!closes_) unit.epoch = ++epochs_;
    unit.barrier_needed = !is_tcp();
  }
  if (!is_tcp()) {
    working_ = true;
    failure_reported_ = false;
    report(LinkEvent::Kind::connected, "serial line open");
  }
  return true;
}

// Called after a new connection succeeded at once because the device had closed a working one.
void ModbusLink::note_closing(std::size_t replies) {
  constexpr int kHabit = 3;
  closings_ = replies == replies_each_ ? closings_ + 1 : 1;
  replies_each_ = replies;
  if (closings_ < kHabit || std::exchange(closes_, true)) return;
  const std::string each = replies == 1 ? "each reply" : std::to_string(replies) + " replies";
  report(LinkEvent::Kind::closes_connections,
         "the device closes its connection after " + each +
             ". A new one is made each time, before the next request.");
}

void ModbusLink::note_oddities() {
  const ModbusTransport::Oddities odd = transport_.take_oddities();
  if (odd.echo) {
    report(LinkEvent::Kind::echo,
           "the line returns what is sent (echo). It is ignored. Switch the receiver off while the "
           "adapter sends, with the adapter's jumper or with rs485: true.");
  }
  if (odd.stray_bytes > 0) {
    report(LinkEvent::Kind::stray_bytes,
           std::to_string(odd.stray_bytes) + (odd.stray_bytes == 1 ? " byte" : " bytes") +
               " before or after a reply, ignored because no request asked for them. Check bias "
               "and termination of the line, and how the transceiver turns round.");
  }
}

// Returns whether the link is connected, free of unrequested bytes, and the unit is due.
bool ModbusLink::ready(LinkTask& task, const Target& target) {
  if (!ensure_connected()) return false;
  discard_unasked(task);
  if (!transport_.connected()) {
    note_lost_connection(closes_);
    if (!ensure_connected()) return false;
  }
  const Unit& unit = unit_of(target.unit);
  if (BusWaiter::now_ns() < unit.retry_at_ns) return false;
  // If the line repeats the barrier's reply as well, another barrier is needed.
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
  if (!ready(task, {request.unit, function, request.address})) return Asked::not_asked;
  return exchange(task, request, reply, Purpose::value);
}

bool ModbusLink::refused(Asked asked, const Reply& reply) noexcept {
  return asked == Asked::exception && !is_transient(reply.exception);
}

// If the device refuses the few extra registers that make the length distinct, they are left out.
ModbusLink::Asked ModbusLink::read(LinkTask& task, ReadShape& shape, Reply& reply) {
  const auto request = [&] {
    return read_request(shape.unit, shape.function, shape.address, shape.count);
  };
  const Asked asked = ask(task, request(), reply);
  if (!refused(asked, reply) || shape.count == shape.needed) return asked;
  shorten(shape);
  return ask(task, request(), reply);
}

void ModbusLink::shorten(ReadShape& shape) {
  const std::lock_guard lock(mutex_);  // attach() looks at the lengths of all tasks
  shape.count = shape.needed;
}

bool ModbusLink::pass_barrier(LinkTask& task, const Target& target) {
  std::uint16_t count = 0;
  {
    const std::lock_guard lock(mutex_);
    count = lengths_.barrier(target.unit, target.function, tasks_);
  }
  const int address = std::min<int>(target.address, 0x10000 - count);
  const Request barrier =
      read_request(target.unit, target.function, static_cast<std::uint16_t>(address), count);
  Reply reply;
  const Asked asked = exchange(task, barrier, reply, Purpose::barrier);
  const bool answered = asked == Asked::valid || asked == Asked::exception;
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
  spoiled_ = outcome == Outcome::invalid;
  note_oddities();
  if (transport_.drained_bytes() > 0) TaskCounters::add(counters.stale_replies_discarded);
  if (purpose == Purpose::value || outcome == Outcome::invalid || transport_.drained_bytes() > 0) {
    unit_of(request.unit).unsettled_ns = BusWaiter::now_ns();
  }
  switch (outcome) {
    case Outcome::valid: note_answer(request); return Asked::valid;
    case Outcome::exception:
      // A barrier may address registers that the device does not have.
      if (purpose == Purpose::value) TaskCounters::add(counters.device_exceptions);
      note_answer(request);
      return Asked::exception;
    case Outcome::timeout: TaskCounters::add(counters.timeouts); break;
    case Outcome::invalid: TaskCounters::add(counters.invalid_replies); break;
    case Outcome::stopped: return Asked::stopped;
    case Outcome::disconnected: break;
  }
  note_failure(request);
  return Asked::failed;
}

void ModbusLink::note_answer(const Request& request) {
  Unit& unit = unit_of(request.unit);
  if (std::exchange(unit.failures, 0) > 0) unit.epoch = ++epochs_;
  ++unit.answers;
  unit.retry_at_ns = 0;
  if (std::exchange(unit.silence_reported, false)) {
    report(LinkEvent::Kind::unit_back, unit_text(request.unit) + " answers again",
           unit_text(request.unit));
  }
  connection_failures_ = 0;
  failure_reported_ = false;
  if (!std::exchange(working_, true)) report(LinkEvent::Kind::connected, "connected");
  // The device is about to close the connection: a request sent now would be lost.
  if (closes_ && transport_.replies() >= replies_each_) transport_.disconnect();
}

void ModbusLink::note_failure(const Request& request) {
  Unit& unit = unit_of(request.unit);
  ++unit.failures;
  if (!transport_.connected()) note_lost_connection(unit.silence_reported);
  // A unit with its own connection is tried again as soon as the connection is open.
  if (is_tcp() && units_.size() == 1) return;
  unit.barrier_needed = !is_tcp();
  if (!is_dead(unit)) return;
  unit.retry_at_ns =
      BusWaiter::now_ns() + back_off_ns(unit.failures - kFailuresOfDeadUnit, kFirstProbeSeconds,
                                        settings_.probe_interval_s);
  if (!std::exchange(unit.silence_reported, true)) {
    report(LinkEvent::Kind::unit_silent, transport_.error(), unit_text(request.unit));
  }
}

// Reconnects at once after the first failures, then at growing intervals.
void ModbusLink::note_lost_connection(bool expected) {
  constexpr int kAtOnce = 2;
  const int failures = ++connection_failures_;
  reconnect_at_ns_ = BusWaiter::now_ns();
  if (failures > kAtOnce) {
    reconnect_at_ns_ +=
        back_off_ns(failures - kAtOnce - 1, settings_.reconnect_min_s, settings_.reconnect_max_s);
  }
  if (expected) return;
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

void ModbusLink::report(LinkEvent::Kind kind, std::string text, std::string subject) const {
  if (sink_) sink_({kind, settings_.name, std::move(subject), std::move(text)});
}

}  // namespace loopwarden::hal::modbus
