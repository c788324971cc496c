// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/map_bank.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "daemon/journal/repeated_refusals.hpp"
#include "daemon/commands/command_text.hpp"
#include "hal/contract/sample.hpp"
#include "hal/modbus/register_codec.hpp"
#include "daemon/registers/register_map.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::gateway {

using alarm::AlarmKind;
using control::Mode;
using hal::modbus::ByteOrder;
using hal::modbus::RegisterSpec;
using hal::modbus::RegisterType;
using registers::Field;
using registers::Place;
using registers::Register;
using registers::Table;

namespace {

RegisterSpec spec_of(const Register& reg, ByteOrder order) {
  // The word order applies to 32-bit values. Single registers are big-endian, as Modbus specifies.
  const bool wide = registers::width(reg) == 2;
  return {.type = reg.type, .order = wide ? order : ByteOrder::abcd, .scale = reg.scale};
}

// Returns NaN for the mark of an unknown value.
double from_scaled(double percent, double low, double high) {
  constexpr double kAboveMark = (registers::kScaledInvalid + 0.5) * 0.01;
  if (percent < kAboveMark) return std::numeric_limits<double>::quiet_NaN();
  return low + percent / 100.0 * (high - low);
}

}  // namespace

Exception MapBank::read(Table table, std::uint16_t address, std::span<std::uint16_t> values) {
  MapValues snapshot(loops_, server_);
  const Register* encoded = nullptr;
  std::size_t encoded_loop = 0;
  hal::modbus::Registers words;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Place place =
        registers::find(table, static_cast<std::uint32_t>(address + i), loops_.loops());
    if (!place.in_map) return Exception::illegal_address;
    values[i] = 0;
    if (place.reg == nullptr) continue;
    if (place.reg != encoded || place.loop != encoded_loop) {
      encoded = place.reg;
      encoded_loop = place.loop;
      const double value = snapshot.value(*place.reg, place.loop);
      // NaN is replaced by 0, because many masters would read it as a number.
      hal::modbus::encode(spec_of(*place.reg, server_.word_order),
                          std::isfinite(value) ? value : 0.0, words);
    }
    values[i] = words.words[place.word];
  }
  return Exception::none;
}

// One register or coil of a write request.
struct MapBank::Wish {
  const Register* reg = nullptr;
  std::size_t loop = 0;
  std::vector<std::uint16_t> words{};
  double value = 0.0;      // value to be commanded
  double old_value = 0.0;  // present reading
  bool in_force = false;   // not a command

  bool is(Field field) const noexcept { return reg->field == field; }
  bool is(Field field, Field scaled) const noexcept { return is(field) || is(scaled); }
};

// All changes that a request makes to one loop, for its cycle.
struct MapBank::LoopCommand {
  std::size_t loop = 0;
  rt::Command command{};
  std::vector<const Wish*> wishes{};  // the writes that the command consists of
};

Exception MapBank::collect(Table table, std::uint16_t address,
                           std::span<const std::uint16_t> values, std::vector<Wish>& wishes) const {
  for (std::size_t i = 0; i < values.size();) {
    const Place place =
        registers::find(table, static_cast<std::uint32_t>(address + i), loops_.loops());
    if (!place.in_map) return Exception::illegal_address;
    if (place.reg == nullptr) {
      // A reserved address between two fields accepts its reading, 0, so that one request can write
      // both fields.
      if (wishes.empty() || i + 1 == values.size() || values[i] != 0) {
        return Exception::illegal_address;
      }
      ++i;
      continue;
    }
    const bool of_loop = place.reg->area != registers::Area::box;
    if (!registers::writable(*place.reg) || (of_loop && loops_.controlled_elsewhere(place.loop))) {
      return Exception::illegal_address;
    }
    const std::size_t words = registers::width(*place.reg);
    // A value of two registers must be written whole.
    if (place.word != 0 || i + words > values.size()) return Exception::illegal_value;
    const auto some = values.subspan(i, words);
    wishes.push_back({.reg = place.reg,
                      .loop = place.loop,
                      .words = {some.begin(), some.end()},
                      .value = hal::modbus::decode(spec_of(*place.reg, server_.word_order), some)});
    i += words;
  }
  return Exception::none;
}

// Returns whether the request ends a commissioning. Any master can do so by a change to manual,
// with or without an output. Manual that is in force has no effect, because masters repeat it.
bool MapBank::takes_back(const std::vector<Wish>& wishes, std::size_t loop) {
  bool manual = false;
  for (const Wish& wish : wishes) {
    if (wish.reg->area == registers::Area::box || wish.loop != loop || wish.in_force) continue;
    if (wish.is(Field::wanted_mode) && wish.value == 0.0) {
      manual = true;
    } else if (!wish.is(Field::wanted_output, Field::wanted_output_scaled)) {
      return false;
    }
  }
  return manual;
}

// Checks each value by itself.
Exception MapBank::check(std::vector<Wish>& wishes, MapValues& snapshot) {
  for (Wish& wish : wishes) {
    wish.old_value = snapshot.value(*wish.reg, wish.loop);
    if (wish.reg->area == registers::Area::box) continue;
    const control::PidSettings& pid = snapshot.loop(wish.loop).settings.controller.pid;
    const hal::PvCheckSettings& pv_range = snapshot.loop(wish.loop).settings.pv_check;
    bool sound = true;
    // coils accept 0 and 1; the cycle checks the other conditions
    const Field field = wish.reg->field;
    if (field == Field::wanted_mode || field == Field::unshelve_process || field == Field::calm) {
      sound = wish.value == 0.0 || wish.value == 1.0;
    } else if (field == Field::wanted_sp_scaled) {
      wish.value = from_scaled(wish.value, pv_range.low, pv_range.high);
      wish.old_value = from_scaled(wish.old_value, pv_range.low, pv_range.high);
    } else if (field == Field::wanted_output_scaled) {
      wish.value = from_scaled(wish.value, pid.output_low, pid.output_high);
      wish.old_value = from_scaled(wish.old_value, pid.output_low, pid.output_high);
    } else if (field == Field::shelve_minutes) {
      const alarm::Alarm& alarm = snapshot.loop(wish.loop).watch.alarms.alarm(alarm_of(*wish.reg));
      sound = wish.value >= 0.0 && wish.value * static_cast<double>(kMinute) <=
                                       static_cast<double>(alarm.settings().shelve_limit_ms);
    }
    if (!sound) return Exception::illegal_value;
  }
  return Exception::none;
}

namespace {

// Returns whether each write is a command. Writes to other registers state the requested value.
bool is_momentary(const Register& reg) noexcept {
  return reg.table == Table::coil || reg.field == Field::shelve_minutes ||
         reg.field == Field::unshelve_process || reg.field == Field::calm;
}

// In manual the commanded output is in force: the device may round it, or the command may be on its
// way.
bool is_output_in_force(double value, bool reads_so, const LoopReading& loop) {
  if (!loop.availability.output_known) return false;
  if (loop.availability.mode == Mode::automatic || loop.availability.output_in_fault)
    return reads_so;
  const control::ControllerSettings& controller = loop.settings.controller;
  const control::PidSettings& pid = controller.pid;
  if (rt::is_same(value, loop.output_wanted, pid.output_low, pid.output_high)) return true;
  const double rounding = std::max(pid.tolerance, controller.output.deadband);
  return reads_so && std::abs(loop.row.co - loop.output_wanted) <= rounding;
}

}  // namespace

void MapBank::find_in_force(std::vector<Wish>& wishes, MapValues& snapshot) const {
  std::map<std::size_t, Mode> new_modes;  // for loops whose mode the request changes
  for (Wish& wish : wishes) {             // in the order of addresses: the mode is first
    if (wish.reg->area != registers::Area::loop || is_momentary(*wish.reg)) continue;
    const LoopReading& loop = snapshot.loop(wish.loop);
    hal::modbus::Registers reads;
    hal::modbus::encode(spec_of(*wish.reg, server_.word_order),
                        snapshot.value(*wish.reg, wish.loop), reads);
    const bool reads_so = std::isfinite(wish.value) &&
                          (wish.value == wish.old_value ||
                           std::equal(wish.words.begin(), wish.words.end(), reads.words.begin()));
    const auto new_mode = new_modes.find(wish.loop);
    const auto becomes = [&](Mode mode) {
      return new_mode != new_modes.end() && new_mode->second == mode;
    };
    if (wish.is(Field::wanted_mode)) {
      const Mode mode = wish.value == 0.0 ? Mode::manual : Mode::automatic;
      wish.in_force = mode == loop.availability.mode;
      if (!wish.in_force) new_modes[wish.loop] = mode;
    } else if (wish.is(Field::wanted_sp, Field::wanted_sp_scaled)) {
      const hal::PvCheckSettings& range = loop.settings.pv_check;
      const bool same =
          reads_so || rt::is_same(wish.value, loop.set_point_wanted, range.low, range.high);
      // On the change to automatic, a set point that followed PV must stay at the written value.
      wish.in_force = same && !becomes(Mode::automatic);
    } else if (wish.is(Field::wanted_output, Field::wanted_output_scaled)) {
      // On the change to manual, the output that the controller moves must stay at the written
      // value.
      wish.in_force = becomes(Mode::automatic) ? reads_so
                                               : !becomes(Mode::manual) &&
                                                     is_output_in_force(wish.value, reads_so, loop);
    } else {
      wish.in_force = reads_so;
    }
  }
}

std::vector<MapBank::LoopCommand> MapBank::orders_of(const std::vector<Wish>& wishes) {
  std::vector<LoopCommand> commands;
  for (const Wish& wish : wishes) {
    if (wish.reg->area != registers::Area::loop || is_momentary(*wish.reg) || wish.in_force)
      continue;
    if (commands.empty() || commands.back().loop != wish.loop)
      commands.push_back({.loop = wish.loop});
    LoopCommand& of_loop = commands.back();
    of_loop.wishes.push_back(&wish);
    if (wish.is(Field::wanted_mode)) {
      of_loop.command.mode = wish.value == 0.0 ? Mode::manual : Mode::automatic;
    } else if (wish.is(Field::wanted_sp, Field::wanted_sp_scaled)) {
      of_loop.command.set_point = wish.value;
    } else if (wish.is(Field::wanted_output, Field::wanted_output_scaled)) {
      of_loop.command.output = wish.value;
    } else if (wish.is(Field::kp)) {
      of_loop.command.kp = wish.value;
    } else if (wish.is(Field::ki)) {
      of_loop.command.ki = wish.value;
    } else if (wish.is(Field::kd)) {
      of_loop.command.kd = wish.value;
    }
  }
  return commands;
}

journal::JournalEntry MapBank::line_of(const Wish& wish, const Peer& peer, MapValues& snapshot) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::register_write;
  entry.utc_ms = snapshot.box().utc_ms;
  if (wish.reg->area == registers::Area::loop) entry.loop = loops_.name(wish.loop);
  entry.peer = peer.name;
  entry.what = wish.reg->name;
  if (std::isfinite(wish.old_value)) entry.old_value = fmt::format("{:.9g}", wish.old_value);
  entry.new_value = fmt::format("{:.9g}", wish.value);
  return entry;
}

Exception MapBank::write(Table table, std::uint16_t address, std::span<const std::uint16_t> values,
                         const Peer& peer) {
  std::vector<Wish> wishes;
  if (const Exception e = collect(table, address, values, wishes); e != Exception::none) return e;
  MapValues snapshot(loops_, server_);
  const Exception unsound = check(wishes, snapshot);
  find_in_force(wishes, snapshot);
  for (const Wish& wish : wishes) {
    if (wish.reg->area == registers::Area::box || !loops_.read_only(wish.loop)) continue;
    if (!takes_back(wishes, wish.loop)) return Exception::illegal_address;
  }
  const auto refuse = [&](Exception exception, const std::string& why) {
    for (const Wish& wish : wishes) {
      if (wish.in_force) continue;
      journal::JournalEntry line = line_of(wish, peer, snapshot);
      line.result = "refused: " + why;
      loops_.write_down(std::move(line));
    }
    return exception;
  };
  if (unsound != Exception::none) return refuse(unsound, "outside its limits");
  std::vector<LoopCommand> commands = orders_of(wishes);
  for (const LoopCommand& asked : commands) {
    const LoopReading& loop = snapshot.loop(asked.loop);
    const rt::Refusal refusal = rt::judge(asked.command, loop.availability, loop.settings,
                                          loop.settings.controller.jacket.form);
    if (refusal != rt::Refusal::none) {
      return refuse(rt::is_out_of_limits(refusal) ? Exception::illegal_value : Exception::busy,
                    commands::why_refused(refusal, asked.command, loop.settings));
    }
    if (!loops_.has_room_for_command(asked.loop)) {
      return refuse(Exception::busy, "too many commands at once");
    }
  }
  for (LoopCommand& asked : commands) {
    std::vector<journal::JournalEntry> lines;
    for (const Wish* wish : asked.wishes) lines.push_back(line_of(*wish, peer, snapshot));
    asked.command.ends_commissioning = loops_.read_only(asked.loop);
    loops_.send(asked.loop, asked.command, std::move(lines));
  }
  for (const Wish& wish : wishes) {
    if (wish.is(Field::master_heartbeat)) {
      // Not written to the journal, because it arrives each second.
      server_.master_heartbeat = static_cast<std::uint16_t>(wish.value);
      server_.master_beat = true;
    } else if (is_momentary(*wish.reg) && is_new(wish, peer, snapshot.box().uptime_s)) {
      act(wish, peer, snapshot);
    }
  }
  return Exception::none;
}

// Returns whether the value is new. A master that repeats a value holds it, which is one command.
// Its 0 is the rest state. It is a command only if the master has held a value before.
bool MapBank::is_new(const Wish& wish, const Peer& peer, double now_s) {
  constexpr double kHeld_s = 30.0;  // longest time between two writes of a held value
  constexpr std::size_t kMostHeld = 10'000;
  const auto key = std::make_tuple(journal::host_of(peer.name), wish.reg->table,
                                   registers::address(*wish.reg, wish.loop));
  const std::uint16_t value = wish.words.front();
  if (value == 0) return held_.erase(key) > 0;
  if (held_.size() >= kMostHeld) {
    std::erase_if(held_, [&](const auto& one) { return now_s - one.second.written_s >= kHeld_s; });
  }
  const auto [held, fresh] = held_.try_emplace(key);
  const Held before = std::exchange(held->second, {value, now_s});
  return fresh || before.value != value || now_s - before.written_s >= kHeld_s;
}

void MapBank::act(const Wish& wish, const Peer& peer, MapValues& snapshot) {
  using alarm::AlarmAction;
  const auto done = [&](std::uint64_t ticket) { ticket_ = std::max(ticket_, ticket); };
  if (wish.is(Field::veto_corrective_action)) {
    return done(loops_.veto(wish.loop, wish.value != 0.0, peer.name));
  }
  if (wish.is(Field::calm)) return calm(wish, peer);
  supervision::AlarmCommand command{
      alarm_of(*wish.reg), AlarmAction::acknowledge, 0, peer.name, {}};
  if (wish.is(Field::shelve_minutes)) {
    // A master may write back the minutes that it has read, up to a minute later.
    const double left = snapshot.value(*wish.reg, wish.loop);
    if (left > 0.0 && (wish.value == left || wish.value == left + 1.0)) return;
    command.action = wish.value == 0.0 ? AlarmAction::unshelve : AlarmAction::shelve;
    command.shelve_ms = static_cast<std::int64_t>(wish.value) * kMinute;
  } else {
    if (wish.value == 0.0) return;  // the rest state of a momentary coil is 0
    if (wish.is(Field::acknowledge_all)) {
      return done(loops_.acknowledge_all(alarm::kAlarmKinds, peer.name));
    }
    if (wish.is(Field::acknowledge_process, Field::unshelve_process)) {
      return act_on_process_alarms(wish, peer);
    }
    if (wish.is(Field::reset)) command.action = AlarmAction::reset;
    if (wish.is(Field::unshelve)) command.action = AlarmAction::unshelve;
  }
  done(loops_.act(wish.loop, command));
}

// Starts planned moves only if they are offered. An earlier write was not meant for this offer.
void MapBank::calm(const Wish& wish, const Peer& peer) {
  if (wish.value == 0.0) return;
  MapValues now(loops_, server_);
  const supervision::AlarmSnapshot& watch = now.loop(wish.loop).watch;
  if (watch.ordered || watch.corrective != alarm::CorrectiveState::offered) return;
  ticket_ = std::max(ticket_, loops_.begin_offered(wish.loop, peer.name));
}

// Acts only on alarms that the action changes, so that the journal has no lines without effect.
void MapBank::act_on_process_alarms(const Wish& wish, const Peer& peer) {
  using alarm::AlarmAction;
  const bool off_shelf = wish.reg->field == Field::unshelve_process;
  MapValues now(loops_, server_);
  const alarm::LoopAlarms& alarms = now.loop(wish.loop).watch.alarms;
  for (const alarm::AlarmKind kind : alarm::kProcessAlarms) {
    const alarm::Alarm& alarm = alarms.alarm(kind);
    if (off_shelf ? !alarm.shelved() : !alarm.unacknowledged()) continue;
    const AlarmAction action = off_shelf ? AlarmAction::unshelve : AlarmAction::acknowledge;
    ticket_ = std::max(ticket_, loops_.act(wish.loop, {kind, action, 0, peer.name, {}}));
  }
}

}  // namespace loopwarden::daemon::gateway
