// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/map_bank.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "daemon/orders/order_text.hpp"
#include "hal/contract/sample.hpp"
#include "hal/modbus/register_codec.hpp"
#include "map/register_map.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::gateway {

namespace map = register_map;
namespace model = loopwarden::monitor;
using control::Mode;
using hal::modbus::ByteOrder;
using hal::modbus::RegisterSpec;
using hal::modbus::RegisterType;
using map::Field;
using map::Place;
using map::Register;
using map::Table;
using model::AlarmKind;

namespace {

constexpr double kHour = 3600.0;          // s
constexpr std::int64_t kMinute = 60'000;  // ms
constexpr double kNotThere = -327.68;     // %, the scaled copy's mark

RegisterSpec spec_of(const Register& reg, ByteOrder order) {
  // The word order is that of 32-bit values; a single register is big-endian, as Modbus has it.
  const bool wide = map::width(reg) == 2;
  return {.type = reg.type, .order = wide ? order : ByteOrder::abcd, .scale = reg.scale};
}

double scaled(double value, double low, double high) {
  if (!std::isfinite(value) || !(high > low)) return kNotThere;
  // The lowest number is the mark of what is not there.
  return std::max(100.0 * (value - low) / (high - low), kNotThere + 0.01);
}

double from_scaled(double percent, double low, double high) {
  return low + percent / 100.0 * (high - low);
}

double flag(bool set) { return set ? 1.0 : 0.0; }
double number(std::size_t value) { return static_cast<double>(value); }
// Of a field that stands for no alarm: the first, of no account.
AlarmKind kind_of(const Register& reg) {
  return reg.field == Field::condition ? AlarmKind{} : static_cast<AlarmKind>(reg.which);
}

double condition_percent(const analysis::ConditionIndices& indices, std::size_t which) {
  const std::array all{indices.control_performance, indices.valve, indices.actuator,
                       indices.positioner, indices.environment};
  return std::isfinite(all[which]) ? all[which] : kNotThere;
}

bool is(const LoopReading& loop, record::RecordFlag bit) { return (loop.row.flags & bit) != 0; }

double shown_pv(const LoopReading& loop) {
  const bool bad = static_cast<hal::Quality>(loop.row.pv_quality) == hal::Quality::bad;
  return bad || !std::isfinite(loop.row.pv) ? loop.last_good_pv : loop.row.pv;
}

unsigned loop_bits(const LoopReading& loop) {
  unsigned bits = 0;
  if (is(loop, record::kAtLow)) bits |= 1U;
  if (is(loop, record::kAtHigh)) bits |= 2U;
  if (is(loop, record::kRateLimited)) bits |= 4U;
  if (is(loop, record::kOutputLost)) bits |= 8U;
  if (is(loop, record::kJacketActs)) bits |= 16U;
  if (std::isfinite(loop.row.stem)) bits |= 32U;
  if (is(loop, record::kCompensatorActs)) bits |= 64U;
  return bits;
}

double minutes_on_shelf(const model::Alarm& alarm, std::int64_t now_ms) {
  if (!alarm.shelved()) return 0.0;
  // Rounded up: an alarm on the shelf never reads 0.
  const std::int64_t left_ms = alarm.memory().shelved_until_ms - now_ms;
  return static_cast<double>(std::max<std::int64_t>((left_ms + kMinute - 1) / kMinute, 1));
}

double of_explanation(Field field, const Explanation* e, std::int64_t now_ms) {
  if (e == nullptr) return field == Field::explanation_gap_closed ? kNotThere : 0.0;
  switch (field) {
    case Field::explanation_effect: return e->effect_number;
    case Field::explanation_agrees: return e->agrees ? 1.0 : 2.0;
    case Field::explanation_size: return e->size_percent;
    case Field::explanation_low: return e->low_percent;
    case Field::explanation_high: return e->high_percent;
    case Field::explanation_gap_closed:
      return std::isfinite(e->gap_closed) ? 100.0 * e->gap_closed : kNotThere;
    case Field::explanation_alarm:
      return 1.0 + number(model::index_of(e->final_name.value_or(e->alarm)));
    default: break;
  }
  return static_cast<double>(std::max<std::int64_t>(now_ms - e->ended_ms, 0)) / 1000.0;
}

}  // namespace

// What the box's block needs of all loops.
struct Totals {
  std::size_t active = 0;
  std::size_t unacknowledged = 0;
  std::size_t shelved = 0;
  std::uint64_t windows = 0;
  model::Ne107 ne107 = model::Ne107::normal;
};

// The plant at the moment of one request: every loop is read at most once.
class MapBank::Snapshot {
 public:
  Snapshot(LoopsView& loops, const ServerState& server) : loops_(loops), server_(server) {}

  // `index` counts only where `reg` belongs to a loop.
  double value(const Register& reg, std::size_t index);

  const LoopReading& loop(std::size_t index) {
    auto found = read_.find(index);
    if (found == read_.end()) found = read_.emplace(index, loops_.read(index)).first;
    return found->second;
  }

  const BoxReading& box() {
    if (!box_) box_ = loops_.box();
    return *box_;
  }

 private:
  const Totals& totals() {
    if (totals_) return *totals_;
    Totals& t = totals_.emplace();
    for (std::size_t i = 0; i < loops_.loops(); ++i) {
      const LoopReading& reading = loop(i);
      t.windows += reading.watch.windows;
      t.ne107 = model::gravest(t.ne107, reading.ne107);
      for (const AlarmKind kind : model::kAlarmKinds) {
        const model::Alarm& alarm = reading.watch.alarms.alarm(kind);
        t.active += alarm.active() ? 1U : 0U;
        t.unacknowledged += alarm.unacknowledged() ? 1U : 0U;
        t.shelved += alarm.shelved() ? 1U : 0U;
      }
    }
    return t;
  }

  double status_bits() {
    unsigned bits = 1U;
    if (box().any_simulated) bits |= 2U;
    if (server_.writes_enabled) bits |= 4U;
    if (totals().unacknowledged > 0) bits |= 8U;
    if (box().journal_trouble) bits |= 16U;
    if (!box().real_time_rights) bits |= 32U;
    if (server_.master_lost) bits |= 64U;
    return static_cast<double>(bits);
  }

  LoopsView& loops_;
  const ServerState& server_;
  std::map<std::size_t, LoopReading> read_;
  std::optional<BoxReading> box_;
  std::optional<Totals> totals_;
  friend class MapBank;
  ByteOrder order_ = ByteOrder::abcd;
};

double MapBank::Snapshot::value(const Register& reg, std::size_t index) {
  const auto wraps = [](double seconds) { return std::fmod(std::floor(seconds), 65536.0); };
  const auto of = [&]() -> const LoopReading& { return loop(index); };
  const auto row = [&]() -> const record::RecordRow& { return of().row; };
  const auto pid = [&]() -> const control::PidSettings& { return of().settings.controller.pid; };
  const auto alarm = [&]() -> const model::Alarm& { return of().watch.alarms.alarm(kind_of(reg)); };
  const auto of_pv = [&](double v) {
    return scaled(v, of().settings.pv_check.low, of().settings.pv_check.high);
  };
  const auto of_co = [&](double v) { return scaled(v, pid().output_low, pid().output_high); };
  switch (reg.field) {
    case Field::magic: return map::kMagic;
    case Field::map_version: return map::kVersion;
    case Field::heartbeat: return wraps(box().uptime_s);
    case Field::status_bits: return status_bits();
    case Field::uptime: return std::floor(box().uptime_s);
    case Field::loop_count: return number(std::min(loops_.loops(), map::kMostLoops));
    case Field::first_block: return map::layout(Table::input_register).first_loop;
    case Field::block_stride: return map::layout(Table::input_register).loop_stride;
    case Field::box_ne107: return static_cast<double>(totals().ne107);
    case Field::overruns: return number(box().overruns);
    case Field::wake_up_worst: return box().wake_up_worst_us;
    case Field::wake_up_p99: return box().wake_up_p99_us;
    case Field::float_test: return static_cast<double>(map::kFloatTest);
    case Field::integer_test: return map::kIntegerTest;
    case Field::config_hash: return box().config_hash;
    case Field::model_hash: return box().model_hash;
    case Field::utc_seconds: return std::floor(static_cast<double>(box().utc_ms) / 1000.0);
    case Field::utc_milliseconds: return static_cast<double>(box().utc_ms % 1000);
    case Field::word_order: return static_cast<double>(order_);
    case Field::alarms_active: return number(totals().active);
    case Field::alarms_unacknowledged: return number(totals().unacknowledged);
    case Field::alarms_shelved: return number(totals().shelved);
    case Field::windows_judged: return number(totals().windows);
    case Field::window_backlog: return number(box().window_backlog);
    case Field::monitor_dropped: return number(box().monitor_dropped);
    case Field::journal_waiting: return number(box().journal_waiting);
    case Field::journal_lost: return number(box().journal_lost);
    case Field::clients: return server_.clients;
    case Field::first_condition: return map::layout(Table::input_register).first_condition;
    case Field::condition_stride: return map::layout(Table::input_register).condition_stride;
    case Field::first_third: return map::layout(Table::holding_register).first_third;
    case Field::third_stride: return map::layout(Table::holding_register).third_stride;
    case Field::running: return 1.0;
    case Field::any_alarm_active: return flag(totals().active > 0);
    case Field::any_alarm_unacknowledged: return flag(totals().unacknowledged > 0);
    case Field::writes_enabled: return flag(server_.writes_enabled);
    case Field::any_simulated: return flag(box().any_simulated);
    case Field::master_lost: return flag(server_.master_lost);
    case Field::journal_trouble: return flag(box().journal_trouble);
    case Field::no_real_time_rights: return flag(!box().real_time_rights);
    case Field::master_heartbeat: return server_.master_heartbeat;
    case Field::sequence_head:
    case Field::sequence_tail: return static_cast<double>(row().period_index & 0xFFFF);
    case Field::mode: return row().mode;
    case Field::requested_mode:
    case Field::wanted_mode: return row().requested_mode;
    case Field::pv_quality: return row().pv_quality;
    case Field::pv_reason: return row().pv_reason;
    case Field::fault: return row().fault;
    case Field::sp: return row().sp;
    case Field::pv: return shown_pv(of());
    case Field::co:
    case Field::wanted_output: return row().co;
    case Field::stem: return row().stem;
    case Field::jacket_rate: return static_cast<double>(row().jacket_rate);
    case Field::jacket_rate_shadow: return static_cast<double>(row().jacket_rate_shadow);
    case Field::compensator: return static_cast<double>(row().compensator);
    case Field::compensator_shadow: return static_cast<double>(row().compensator_shadow);
    case Field::orders_refused: return of().orders_refused;
    case Field::sp_scaled: return of_pv(row().sp);
    case Field::pv_scaled: return of_pv(row().pv);
    case Field::co_scaled:
    case Field::wanted_output_scaled: return of_co(row().co);
    case Field::stem_scaled: return of_co(row().stem);
    case Field::pv_age: return static_cast<double>(row().age_ms);
    case Field::ne107: return static_cast<double>(of().ne107);
    case Field::loop_bits: return static_cast<double>(loop_bits(of()));
    case Field::variability: return of().watch.measures.variability_percent;
    case Field::mean_error: return of().watch.measures.mean_error_percent;
    case Field::oscillation_index: return of().watch.measures.oscillation_index;
    case Field::oscillation_period: return of().watch.measures.period_s;
    case Field::travel: return of().watch.measures.travel_percent_per_hour;
    case Field::reversals: return of().watch.measures.reversals_per_hour;
    case Field::stick: return of().watch.measures.stick_percent;
    case Field::stick_source: return static_cast<double>(of().watch.measures.stick_source);
    case Field::saturated: return of().watch.measures.saturated_percent;
    case Field::window_state: return static_cast<double>(of().watch.window_state);
    case Field::window_number: return of().watch.windows;
    case Field::window_severity: return of().watch.judgement.severity_percent;
    case Field::probability: return 100.0 * of().watch.judgement.probability[reg.which];
    case Field::alarm_severity:
      return alarm().active() && model::has_size(kind_of(reg)) ? alarm().memory().severity_percent
                                                               : 0.0;
    case Field::alarm_state: return static_cast<double>(alarm().state());
    case Field::hours_automatic: return of().watch.times.seconds_in(Mode::automatic) / kHour;
    case Field::hours_manual: return of().watch.times.seconds_in(Mode::manual) / kHour;
    case Field::hours_at_limit: return of().watch.times.seconds_at_limit() / kHour;
    case Field::records_dropped: return number(of().dropped);
    case Field::corrective_action: return static_cast<double>(of().watch.corrective);
    case Field::condition: return condition_percent(of().watch.condition, reg.which);
    case Field::veto_corrective_action: return flag(of().watch.veto != model::Veto::none);
    case Field::alarm_active: return flag(alarm().active());
    case Field::alarm_unacknowledged: return flag(alarm().unacknowledged());
    case Field::pv_bad:
      return flag(static_cast<hal::Quality>(row().pv_quality) == hal::Quality::bad);
    case Field::at_low: return flag(is(of(), record::kAtLow));
    case Field::at_high: return flag(is(of(), record::kAtHigh));
    case Field::in_manual: return flag(static_cast<Mode>(row().mode) == Mode::manual);
    case Field::any_suppressed: return flag(of().watch.alarms.any_suppressed());
    case Field::any_shelved: return flag(of().watch.alarms.any_shelved());
    case Field::communication_lost: return flag(is(of(), record::kOutputLost));
    case Field::in_fault:
      return flag(static_cast<control::Fault>(row().fault) != control::Fault::none);
    case Field::window_valid: return flag(of().watch.window_state == model::WindowState::valid);
    case Field::wanted_sp: return of().set_point_wanted;
    case Field::wanted_sp_scaled: return of_pv(of().set_point_wanted);
    case Field::kp: return pid().gains.kp;
    case Field::ki: return pid().gains.ki;
    case Field::kd: return pid().gains.kd;
    case Field::shelve_minutes: return minutes_on_shelf(alarm(), box().utc_ms);
    case Field::explanation_effect:
    case Field::explanation_agrees:
    case Field::explanation_size:
    case Field::explanation_low:
    case Field::explanation_high:
    case Field::explanation_gap_closed:
    case Field::explanation_alarm:
    case Field::explanation_age:
      return of_explanation(reg.field, of().watch.explanation.get(), box().utc_ms);
    // A momentary coil rests at 0.
    case Field::acknowledge_all:
    case Field::acknowledge:
    case Field::reset:
    case Field::unshelve: break;
  }
  return 0.0;
}

Exception MapBank::read(Table table, std::uint16_t address, std::span<std::uint16_t> values) {
  Snapshot snapshot(loops_, server_);
  snapshot.order_ = order_;
  const Register* encoded = nullptr;
  std::size_t encoded_loop = 0;
  hal::modbus::Registers words;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Place place = map::find(table, static_cast<std::uint32_t>(address + i), loops_.loops());
    if (!place.in_map) return Exception::illegal_address;
    values[i] = 0;
    if (place.reg == nullptr) continue;
    if (place.reg != encoded || place.loop != encoded_loop) {
      encoded = place.reg;
      encoded_loop = place.loop;
      const double value = snapshot.value(*place.reg, place.loop);
      // A number that is none would be taken for one by many masters.
      hal::modbus::encode(spec_of(*place.reg, order_), std::isfinite(value) ? value : 0.0, words);
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
  double value = 0.0;      // as it will be ordered
  double old_value = 0.0;  // as it reads
  bool in_force = false;   // it writes what it would read
};

// All that a request asks of one loop's cycle.
struct MapBank::LoopOrder {
  std::size_t loop = 0;
  rt::Order order{};
  std::vector<const Wish*> wishes{};  // that the order is made of
  std::vector<const Wish*>
      already{};  // that ask for what is so, where the mode would forbid to ask
};

Exception MapBank::collect(Table table, std::uint16_t address,
                           std::span<const std::uint16_t> values, std::vector<Wish>& wishes) const {
  for (std::size_t i = 0; i < values.size();) {
    const Place place = map::find(table, static_cast<std::uint32_t>(address + i), loops_.loops());
    if (!place.in_map) return Exception::illegal_address;
    if (place.reg == nullptr) {
      // A gap between two fields takes the 0 that it reads, so that one request can write both.
      if (wishes.empty() || i + 1 == values.size() || values[i] != 0) {
        return Exception::illegal_address;
      }
      ++i;
      continue;
    }
    if (!map::writable(*place.reg)) return Exception::illegal_address;
    const std::size_t words = map::width(*place.reg);
    // Half of a number is no number.
    if (place.word != 0 || i + words > values.size()) return Exception::illegal_value;
    const auto some = values.subspan(i, words);
    wishes.push_back({.reg = place.reg,
                      .loop = place.loop,
                      .words = {some.begin(), some.end()},
                      .value = hal::modbus::decode(spec_of(*place.reg, order_), some)});
    i += words;
  }
  return Exception::none;
}

// What can be judged of a value by itself.
Exception MapBank::check(std::vector<Wish>& wishes, Snapshot& snapshot) {
  for (Wish& wish : wishes) {
    wish.old_value = snapshot.value(*wish.reg, wish.loop);
    hal::modbus::Registers reads;
    hal::modbus::encode(spec_of(*wish.reg, order_), wish.old_value, reads);
    wish.in_force = std::equal(wish.words.begin(), wish.words.end(), reads.words.begin());
    if (wish.reg->area == map::Area::box) continue;
    const control::PidSettings& pid = snapshot.loop(wish.loop).settings.controller.pid;
    const hal::PvCheckSettings& pv_range = snapshot.loop(wish.loop).settings.pv_check;
    bool sound = true;
    const Field field = wish.reg->field;  // coils take 0 and 1; the cycle's rule judges the rest
    if (field == Field::wanted_mode) {
      sound = wish.value == 0.0 || wish.value == 1.0;
    } else if (field == Field::wanted_sp_scaled) {
      wish.value = from_scaled(wish.value, pv_range.low, pv_range.high);
      wish.old_value = from_scaled(wish.old_value, pv_range.low, pv_range.high);
    } else if (field == Field::wanted_output_scaled) {
      wish.value = from_scaled(wish.value, pid.output_low, pid.output_high);
      wish.old_value = from_scaled(wish.old_value, pid.output_low, pid.output_high);
    } else if (field == Field::shelve_minutes) {
      const model::Alarm& alarm = snapshot.loop(wish.loop).watch.alarms.alarm(kind_of(*wish.reg));
      sound = wish.value >= 0.0 && wish.value * static_cast<double>(kMinute) <=
                                       static_cast<double>(alarm.settings().shelve_limit_ms);
    }
    if (!sound) return Exception::illegal_value;
  }
  return Exception::none;
}

std::vector<MapBank::LoopOrder> MapBank::orders_of(const std::vector<Wish>& wishes) {
  std::vector<LoopOrder> orders;
  for (const Wish& wish : wishes) {
    if (wish.reg->table != Table::holding_register || wish.reg->area != map::Area::loop) continue;
    if (wish.reg->field == Field::shelve_minutes) continue;
    if (orders.empty() || orders.back().loop != wish.loop) orders.push_back({.loop = wish.loop});
    LoopOrder& of_loop = orders.back();
    of_loop.wishes.push_back(&wish);
    const Field field = wish.reg->field;
    if (field == Field::wanted_mode) {
      of_loop.order.mode = wish.value == 0.0 ? Mode::manual : Mode::automatic;
    } else if (field == Field::wanted_sp || field == Field::wanted_sp_scaled) {
      of_loop.order.set_point = wish.value;
    } else if (field == Field::wanted_output || field == Field::wanted_output_scaled) {
      of_loop.order.output = wish.value;
    } else if (field == Field::kp) {
      of_loop.order.kp = wish.value;
    } else if (field == Field::ki) {
      of_loop.order.ki = wish.value;
    } else if (field == Field::kd) {
      of_loop.order.kd = wish.value;
    }
  }
  return orders;
}

// By the rule of the cycle. Where the mode forbids to order a value, one may write what is in force.
rt::Refusal MapBank::judge(LoopOrder& asked, const LoopReading& loop) {
  const auto refusal = [&] {
    return rt::judge(asked.order, loop.standing, loop.settings,
                     loop.settings.controller.jacket.form);
  };
  const auto leave_out = [&](Field field, Field scaled, std::optional<double>& part) {
    const auto of_it = [&](const Wish* wish) {
      return wish->reg->field == field || wish->reg->field == scaled;
    };
    const bool in_force =
        std::all_of(asked.wishes.begin(), asked.wishes.end(),
                    [&](const Wish* wish) { return !of_it(wish) || wish->in_force; });
    if (!in_force) return false;
    const auto kept = std::stable_partition(asked.wishes.begin(), asked.wishes.end(),
                                            [&](const Wish* wish) { return !of_it(wish); });
    asked.already.insert(asked.already.end(), kept, asked.wishes.end());
    asked.wishes.erase(kept, asked.wishes.end());
    part.reset();
    return true;
  };
  rt::Refusal why = refusal();
  if (why == rt::Refusal::output_in_automatic || why == rt::Refusal::output_in_fault) {
    if (leave_out(Field::wanted_output, Field::wanted_output_scaled, asked.order.output)) {
      why = refusal();
    }
  }
  if (why == rt::Refusal::set_point_tracks) {
    if (leave_out(Field::wanted_sp, Field::wanted_sp_scaled, asked.order.set_point)) {
      why = refusal();
    }
  }
  return why;
}

journal::JournalEntry MapBank::line_of(const Wish& wish, const Peer& peer, Snapshot& snapshot) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::register_write;
  entry.utc_ms = snapshot.box().utc_ms;
  if (wish.reg->area == map::Area::loop) entry.loop = loops_.name(wish.loop);
  entry.peer = peer.name;
  entry.what = wish.reg->name;
  entry.old_value = fmt::format("{:.9g}", wish.old_value);
  entry.new_value = fmt::format("{:.9g}", wish.value);
  return entry;
}

Exception MapBank::write(Table table, std::uint16_t address, std::span<const std::uint16_t> values,
                         const Peer& peer) {
  std::vector<Wish> wishes;
  if (const Exception e = collect(table, address, values, wishes); e != Exception::none) return e;
  Snapshot snapshot(loops_, server_);
  const auto write_down = [&](const Wish& wish, const std::string& result) {
    journal::JournalEntry line = line_of(wish, peer, snapshot);
    line.result = result;
    loops_.write_down(std::move(line));
  };
  const auto refuse = [&](Exception exception, const std::string& why) {
    for (const Wish& wish : wishes) write_down(wish, "refused: " + why);
    return exception;
  };
  if (const Exception unsound = check(wishes, snapshot); unsound != Exception::none) {
    return refuse(unsound, "outside its limits");
  }
  std::vector<LoopOrder> orders = orders_of(wishes);
  for (LoopOrder& asked : orders) {
    const LoopReading& loop = snapshot.loop(asked.loop);
    const rt::Refusal refusal = judge(asked, loop);
    if (refusal != rt::Refusal::none) {
      return refuse(rt::is_out_of_limits(refusal) ? Exception::illegal_value : Exception::busy,
                    orders::why_refused(refusal, asked.order, loop.settings));
    }
    if (!loops_.has_room_for_order(asked.loop)) {
      return refuse(Exception::busy, "too many commands at once");
    }
  }
  for (const LoopOrder& asked : orders) {
    for (const Wish* wish : asked.already) write_down(*wish, "in force already");
    if (asked.wishes.empty()) continue;
    std::vector<journal::JournalEntry> lines;
    for (const Wish* wish : asked.wishes) lines.push_back(line_of(*wish, peer, snapshot));
    loops_.order(asked.loop, asked.order, std::move(lines));
  }
  for (const Wish& wish : wishes) {
    if (wish.reg->field == Field::master_heartbeat) {
      // Not for the journal: it comes each second.
      server_.master_heartbeat = static_cast<std::uint16_t>(wish.value);
      server_.master_beat = true;
    } else if (wish.reg->table == Table::coil || wish.reg->field == Field::shelve_minutes) {
      act(wish, peer);
    }
  }
  return Exception::none;
}

void MapBank::act(const Wish& wish, const Peer& peer) {
  using model::AlarmAction;
  if (wish.reg->field == Field::veto_corrective_action) {
    loops_.veto(wish.loop, wish.value != 0.0, peer.name);
    return;
  }
  monitor::AlarmOrder order{kind_of(*wish.reg), AlarmAction::acknowledge, 0, peer.name, {}};
  if (wish.reg->field == Field::shelve_minutes) {
    order.action = wish.value == 0.0 ? AlarmAction::unshelve : AlarmAction::shelve;
    order.shelve_ms = static_cast<std::int64_t>(wish.value) * kMinute;
  } else {
    if (wish.value == 0.0) return;  // a momentary coil rests at 0
    if (wish.reg->field == Field::acknowledge_all) {
      acknowledge_all(peer);
      return;
    }
    if (wish.reg->field == Field::reset) order.action = AlarmAction::reset;
    if (wish.reg->field == Field::unshelve) order.action = AlarmAction::unshelve;
  }
  // An order for which there is nothing to do is no error: masters repeat themselves.
  loops_.act(wish.loop, order);
}

void MapBank::acknowledge_all(const Peer& peer) {
  for (std::size_t i = 0; i < loops_.loops(); ++i) {
    const LoopReading loop = loops_.read(i);
    for (const AlarmKind kind : model::kAlarmKinds) {
      if (!loop.watch.alarms.alarm(kind).unacknowledged()) continue;
      loops_.act(i, {kind, model::AlarmAction::acknowledge, 0, peer.name, {}});
    }
  }
}

}  // namespace loopwarden::daemon::gateway
