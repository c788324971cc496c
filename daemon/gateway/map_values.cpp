// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/map_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/contract/sample.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::gateway {

using alarm::AlarmKind;
using control::Mode;
using registers::Field;
using registers::Register;
using registers::Table;

namespace {

constexpr double kHour = 3600.0;       // s
constexpr double kNotThere = -327.68;  // %, the scaled copy's mark of an unknown value

double scaled(double value, double low, double high) {
  if (!std::isfinite(value) || !(high > low)) return kNotThere;
  // The lowest number is reserved for unknown values.
  return std::max(100.0 * (value - low) / (high - low), kNotThere + 0.01);
}

double flag(bool set) { return set ? 1.0 : 0.0; }
double number(std::size_t value) { return static_cast<double>(value); }
double condition_percent(const analysis::ConditionIndices& indices, std::size_t which) {
  const std::array all{indices.control_performance, indices.valve, indices.actuator,
                       indices.positioner, indices.environment};
  return std::isfinite(all[which]) ? all[which] : kNotThere;
}

bool is(const LoopReading& loop, record::RecordFlag bit) { return (loop.row.flags & bit) != 0; }

double shown_pv(const LoopReading& loop) {
  const bool bad = loop.row.pv_quality == hal::Quality::bad;
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

// Returns the bits of the process alarms for which `holds` returns true.
template <class Holds>
double process_bits(const LoopReading& loop, Holds holds) {
  unsigned bits = 0;
  for (const AlarmKind kind : alarm::kProcessAlarms) {
    const alarm::LoopAlarms& alarms = loop.watch.alarms;
    if (alarms.fitted(kind) && holds(alarms.alarm(kind))) bits |= alarm::process_bit(kind);
  }
  return static_cast<double>(bits);
}

double minutes_on_shelf(const alarm::Alarm& alarm, std::int64_t now_ms) {
  if (!alarm.shelved()) return 0.0;
  // Rounded up, so that a shelved alarm never reads 0.
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
      return 1.0 + number(alarm::index_of(e->final_name.value_or(e->alarm)));
    default: break;
  }
  return static_cast<double>(std::max<std::int64_t>(now_ms - e->ended_ms, 0)) / 1000.0;
}

}  // namespace

AlarmKind alarm_of(const Register& reg) noexcept {
  return reg.field == Field::condition ? AlarmKind{} : static_cast<AlarmKind>(reg.which);
}

const LoopReading& MapValues::loop(std::size_t index) {
  auto found = read_.find(index);
  if (found == read_.end()) found = read_.emplace(index, plant_.read(index)).first;
  return found->second;
}

const BoxReading& MapValues::box() {
  if (!box_) box_ = plant_.box();
  return *box_;
}

const MapValues::Totals& MapValues::totals() {
  if (totals_) return *totals_;
  Totals& t = totals_.emplace(Totals{});
  for (std::size_t i = 0; i < plant_.loops(); ++i) {
    const LoopReading& reading = loop(i);
    t.windows += reading.watch.windows;
    t.ne107 = alarm::gravest(t.ne107, reading.ne107);
    for (const AlarmKind kind : alarm::kAlarmKinds) {
      const alarm::Alarm& alarm = reading.watch.alarms.alarm(kind);
      t.active += alarm.active() ? 1U : 0U;
      t.unacknowledged += alarm.unacknowledged() ? 1U : 0U;
      t.shelved += alarm.shelved() ? 1U : 0U;
    }
  }
  return t;
}

double MapValues::status_bits() {
  unsigned bits = 1U;
  if (box().any_simulated) bits |= 2U;
  if (server_.writes_enabled) bits |= 4U;
  if (totals().unacknowledged > 0) bits |= 8U;
  if (box().journal_trouble) bits |= 16U;
  if (!box().real_time_rights) bits |= 32U;
  if (server_.master_lost) bits |= 64U;
  return static_cast<double>(bits);
}

double MapValues::value(const Register& reg, std::size_t index) {
  const auto wraps = [](double seconds) { return std::fmod(std::floor(seconds), 65536.0); };
  const auto of = [&]() -> const LoopReading& { return loop(index); };
  const auto row = [&]() -> const record::RecordRow& { return of().row; };
  const auto pid = [&]() -> const control::PidSettings& { return of().settings.controller.pid; };
  const auto alarm = [&]() -> const alarm::Alarm& {
    return of().watch.alarms.alarm(alarm_of(reg));
  };
  const auto of_pv = [&](double v) {
    return scaled(v, of().settings.pv_check.low, of().settings.pv_check.high);
  };
  const auto of_co = [&](double v) { return scaled(v, pid().output_low, pid().output_high); };
  switch (reg.field) {
    case Field::magic: return registers::kMagic;
    case Field::map_version: return registers::kVersion;
    case Field::heartbeat: return wraps(box().uptime_s);
    case Field::status_bits: return status_bits();
    case Field::uptime: return std::floor(box().uptime_s);
    case Field::loop_count: return number(std::min(plant_.loops(), registers::kMostLoops));
    case Field::first_block: return registers::layout(Table::input_register).first_loop;
    case Field::block_stride: return registers::layout(Table::input_register).loop_stride;
    case Field::box_ne107: return static_cast<double>(totals().ne107);
    case Field::overruns: return number(box().overruns);
    case Field::wake_up_worst: return box().wake_up_worst_us;
    case Field::wake_up_p99: return box().wake_up_p99_us;
    case Field::float_test: return static_cast<double>(registers::kFloatTest);
    case Field::integer_test: return registers::kIntegerTest;
    case Field::config_hash: return box().config_hash;
    case Field::model_hash: return box().model_hash;
    case Field::utc_seconds: return std::floor(static_cast<double>(box().utc_ms) / 1000.0);
    case Field::utc_milliseconds: return static_cast<double>(box().utc_ms % 1000);
    case Field::word_order: return static_cast<double>(server_.word_order);
    case Field::alarms_active: return number(totals().active);
    case Field::alarms_unacknowledged: return number(totals().unacknowledged);
    case Field::alarms_shelved: return number(totals().shelved);
    case Field::windows_judged: return number(totals().windows);
    case Field::window_backlog: return number(box().window_backlog);
    case Field::monitor_dropped: return number(box().monitor_dropped);
    case Field::journal_waiting: return number(box().journal_waiting);
    case Field::journal_lost: return number(box().journal_lost);
    case Field::clients: return server_.clients;
    case Field::first_condition: return registers::layout(Table::input_register).first_condition;
    case Field::condition_stride: return registers::layout(Table::input_register).condition_stride;
    case Field::first_third: return registers::layout(Table::holding_register).first_third;
    case Field::third_stride: return registers::layout(Table::holding_register).third_stride;
    case Field::box_alarms: return box().box_alarms;
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
    case Field::mode: return static_cast<double>(row().mode);
    case Field::requested_mode:
    case Field::wanted_mode: return static_cast<double>(row().requested_mode);
    case Field::pv_quality: return static_cast<double>(row().pv_quality);
    case Field::pv_reason: return static_cast<double>(row().pv_reason);
    case Field::fault: return static_cast<double>(row().fault);
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
    case Field::moves_phase: return of().moves ? 1.0 + static_cast<double>(of().moves->phase) : 0.0;
    case Field::moves_gain: return of().moves ? of().moves->gain : 0.0;
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
      return alarm().active() && alarm::has_size(alarm_of(reg)) ? alarm().memory().severity_percent
                                                                : 0.0;
    case Field::alarm_state: return static_cast<double>(alarm().state());
    case Field::hours_automatic: return of().watch.times.seconds_in(Mode::automatic) / kHour;
    case Field::hours_manual: return of().watch.times.seconds_in(Mode::manual) / kHour;
    case Field::hours_at_limit: return of().watch.times.seconds_at_limit() / kHour;
    case Field::records_dropped: return number(of().dropped);
    case Field::corrective_action: return static_cast<double>(of().watch.corrective);
    case Field::condition: return condition_percent(of().watch.condition, reg.which);
    case Field::veto_corrective_action: return flag(of().watch.veto != alarm::Veto::none);
    case Field::alarm_active: return flag(alarm().active());
    case Field::alarm_unacknowledged: return flag(alarm().unacknowledged());
    case Field::pv_bad: return flag(row().pv_quality == hal::Quality::bad);
    case Field::at_low: return flag(is(of(), record::kAtLow));
    case Field::at_high: return flag(is(of(), record::kAtHigh));
    case Field::in_manual: return flag(row().mode == Mode::manual);
    case Field::any_suppressed: return flag(of().watch.alarms.any_suppressed());
    case Field::any_shelved: return flag(of().watch.alarms.any_shelved());
    case Field::communication_lost: return flag(is(of(), record::kOutputLost));
    case Field::in_fault: return flag(row().fault != control::Fault::none);
    case Field::window_valid: return flag(of().watch.window_state == alarm::WindowState::valid);
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
    case Field::process_active:
      return process_bits(of(), [](const alarm::Alarm& a) { return a.active(); });
    case Field::process_unacknowledged:
      return process_bits(of(), [](const alarm::Alarm& a) { return a.unacknowledged(); });
    case Field::process_shelved:
      return process_bits(of(), [](const alarm::Alarm& a) { return a.shelved(); });
    case Field::process_suppressed:
      return process_bits(
          of(), [](const alarm::Alarm& a) { return a.state() == alarm::AlarmState::suppressed; });
    // Momentary coils read 0.
    case Field::acknowledge_process:
    case Field::unshelve_process:
    case Field::acknowledge_all:
    case Field::acknowledge:
    case Field::reset:
    case Field::unshelve:
    case Field::calm: break;
  }
  return 0.0;
}

}  // namespace loopwarden::daemon::gateway
