// SPDX-License-Identifier: Apache-2.0
#include "daemon/registers/register_map.hpp"

#include <array>

namespace loopwarden::registers {
namespace {

using hal::modbus::RegisterType;
constexpr RegisterType u16 = RegisterType::u16;
constexpr RegisterType i16 = RegisterType::i16;
constexpr RegisterType u32 = RegisterType::u32;
constexpr RegisterType f32 = RegisterType::f32;

constexpr double kHundredth = 0.01;

constexpr Register box_in(Field field, std::uint16_t offset, RegisterType type, const char* name,
                          const char* unit, const char* meaning) {
  return {field, 0, Table::input_register, Area::box, offset, type, 1.0, name, unit, meaning};
}
constexpr Register loop_in(Field field, std::uint16_t offset, RegisterType type, const char* name,
                           const char* unit, const char* meaning, double scale = 1.0,
                           std::uint8_t alarm = 0) {
  return {field, alarm,  Table::input_register, Area::loop, offset, type, scale, name,
          unit,  meaning};
}
constexpr Register condition_in(std::uint8_t which, const char* name, const char* meaning) {
  return {Field::condition, which, Table::input_register,
          Area::condition,  which, i16,
          kHundredth,       name,  "%",
          meaning};
}
constexpr Register holding(Field field, Area area, std::uint16_t offset, RegisterType type,
                           const char* name, const char* unit, const char* meaning,
                           double scale = 1.0, std::uint8_t alarm = 0) {
  return {field, alarm, Table::holding_register, area, offset, type, scale, name, unit, meaning};
}
constexpr Register bit(Field field, Table table, Area area, std::uint16_t offset, const char* name,
                       const char* meaning, std::uint8_t alarm = 0) {
  return {field, alarm, table, area, offset, u16, 1.0, name, "", meaning};
}
constexpr Register box_bit(Field field, std::uint16_t offset, const char* name,
                           const char* meaning) {
  return bit(field, Table::discrete_input, Area::box, offset, name, meaning);
}
constexpr Register loop_bit(Field field, std::uint16_t offset, const char* name,
                            const char* meaning, std::uint8_t alarm = 0) {
  return bit(field, Table::discrete_input, Area::loop, offset, name, meaning, alarm);
}
constexpr Register loop_coil(Field field, std::uint16_t offset, const char* name,
                             const char* meaning, std::uint8_t alarm) {
  return bit(field, Table::coil, Area::loop, offset, name, meaning, alarm);
}

constexpr const char* kScaled = "0.01 % of the span from its low end; -32768: not there";
constexpr const char* kProbability = "probability in the newest window that was judged";
constexpr const char* kSeverity = "size, median of the windows that name the alarm; 0: off";
constexpr const char* kState =
    "0 normal, 1 unacknowledged, 2 acknowledged, 3 returned unacknowledged, 4 latched "
    "unacknowledged, 5 latched acknowledged, 6 shelved, 7 suppressed";
constexpr const char* kActive =
    "condition of the alarm is on, also if the alarm is acknowledged or shelved";
constexpr const char* kWaits = "the alarm waits for the operator";
constexpr const char* kShelve =
    "write: shelve the alarm for this time, 0: end a shelf that the same master has set; read: "
    "minutes left";
constexpr const char* kAcknowledge = "write 1: acknowledge; reads 0";
constexpr const char* kReset = "write 1: reset, if latched; reads 0";
constexpr const char* kUnshelve = "write 1: unshelve; reads 0";

constexpr std::array kRegisters{
    box_in(Field::magic, 0, u16, "magic", "", "0x4C50: this is a Loopwarden map"),
    box_in(Field::map_version, 1, u16, "map_version", "",
           "major x 256 + minor; the major number changes when a field moves"),
    box_in(Field::heartbeat, 2, u16, "heartbeat", "", "+1 each second, wraps at 65535"),
    box_in(
        Field::status_bits, 3, u16, "status_bits", "",
        "1 running, 2 a loop is simulated or replayed, 4 writes enabled, 8 an alarm waits for the "
        "operator, 16 the journal can't write, 32 no real-time rights, 64 the master's heartbeat "
        "has stopped"),
    box_in(Field::uptime, 4, u32, "uptime", "s", "since the daemon's start"),
    box_in(Field::loop_count, 6, u16, "loop_count", "", "loops that have a block"),
    box_in(Field::first_block, 7, u16, "first_block", "", "address of the first loop's block"),
    box_in(Field::block_stride, 8, u16, "block_stride", "", "from one loop's block to the next"),
    box_in(Field::box_ne107, 9, u16, "ne107", "",
           "NAMUR NE 107, the gravest of all loops: 0 normal, 1 maintenance required, 2 out of "
           "specification, 3 function check, 4 failure"),
    box_in(Field::overruns, 10, u32, "overruns", "", "cycles of the loop thread that started late"),
    box_in(Field::wake_up_worst, 12, u16, "wake_up_worst", "us",
           "worst wake-up latency of the loop thread; 65535: at least"),
    box_in(Field::wake_up_p99, 13, u16, "wake_up_p99", "us", "99th percentile of it"),
    box_in(Field::float_test, 14, f32, "float_test", "",
           "always 123456.0: 0x47F1 0x2000 in word order abcd"),
    box_in(Field::integer_test, 16, u32, "integer_test", "", "always 0x01020304 = 16909060"),
    box_in(Field::config_hash, 18, u32, "config_hash", "",
           "of the configuration files in force; matches no set of files while a change waits for "
           "a restart; 0: unknown"),
    box_in(Field::model_hash, 20, u32, "model_hash", "", "of the specialists; 0: none"),
    box_in(Field::utc_seconds, 22, u32, "utc_seconds", "s", "Unix time of this answer"),
    box_in(Field::utc_milliseconds, 24, u16, "utc_milliseconds", "ms", "of that second"),
    box_in(Field::word_order, 25, u16, "word_order", "",
           "of 32-bit values: 0 abcd, 1 cdab, 2 badc, 3 dcba"),
    box_in(Field::alarms_active, 26, u16, "alarms_active", "", "alarms whose condition is on"),
    box_in(Field::alarms_unacknowledged, 27, u16, "alarms_unacknowledged", "",
           "alarms that wait for the operator"),
    box_in(Field::alarms_shelved, 28, u16, "alarms_shelved", "", "shelved alarms"),
    box_in(Field::windows_judged, 30, u32, "windows_judged", "", "since the start, of all loops"),
    box_in(Field::window_backlog, 32, u16, "window_backlog", "",
           "loops with cycles that the monitor has not looked at yet"),
    box_in(Field::monitor_dropped, 34, u32, "monitor_dropped", "",
           "cycles of all loops that the monitor dropped because it was too slow"),
    box_in(Field::journal_waiting, 36, u16, "journal_waiting", "",
           "lines of the journal that are not on the disk yet; 65535: at least"),
    box_in(Field::journal_lost, 37, u16, "journal_lost", "",
           "lines that could not be written; 65535: at least"),
    box_in(Field::clients, 38, u16, "clients", "", "connections to this server"),
    box_in(Field::first_condition, 39, u16, "first_condition", "",
           "address of the first loop's second block"),
    box_in(Field::condition_stride, 40, u16, "condition_stride", "",
           "from one loop's second block to the next"),
    box_in(Field::first_third, 41, u16, "first_third", "",
           "address of the first loop's third block, of holding registers and of coils"),
    box_in(Field::third_stride, 42, u16, "third_stride", "",
           "from one loop's third block of holding registers to the next"),
    box_in(Field::box_alarms, 43, u16, "box_alarms", "",
           "the box's own alarms whose condition is on: 1 disk_full, 2 clock_stepped, "
           "4 feeder_lost, 8 service_failed, 16 certificate_expires, 32 records_dropped, 64 "
           "disk_writes, 128 connection_lost"),

    loop_in(Field::sequence_head, 0, u16, "sequence_head", "",
            "counts the loop's cycles; equal to sequence_tail if the block is of one cycle"),
    loop_in(Field::mode, 1, u16, "mode", "", "0 manual, 1 automatic, 2 fallback"),
    loop_in(Field::requested_mode, 2, u16, "requested_mode", "",
            "mode that the operator asked for: 0 manual, 1 automatic"),
    loop_in(Field::pv_quality, 3, u16, "pv_quality", "", "192 good, 64 uncertain, 0 bad"),
    loop_in(Field::pv_reason, 4, u16, "pv_reason", "",
            "0 none, 1 never received, 2 stale, 3 not finite, 4 out of range, 5 sensor failure, "
            "6 device error, 7 link lost, 8 frozen, 9 end of record, 10 held, 11 said by the "
            "source, 12 timeout of the source, 13 death of the source, 14 out of service"),
    loop_in(
        Field::fault, 5, u16, "fault", "",
        "0 none, 1 starting, 2 bad PV, 3 output lost, 4 late cycle, 5 not finite, 6 enable open, 7 "
        "stop, 8 output unknown"),
    loop_in(Field::sp, 6, f32, "sp", "PV", "working set point"),
    loop_in(Field::pv, 8, f32, "pv", "PV",
            "process variable; the last good one while pv_quality is bad, never NaN"),
    loop_in(Field::co, 10, f32, "co", "CO",
            "controller output as sent to the device; 0 while unknown, and co_scaled reads -32768"),
    loop_in(Field::stem, 12, f32, "stem", "CO",
            "read-back of the valve; 0 without a read-back, and bit 32 of loop_bits is clear"),
    loop_in(Field::jacket_rate, 14, f32, "jacket_rate", "CO/s",
            "what the stickband jacket adds to the integral; 0 without one"),
    loop_in(Field::sp_scaled, 16, i16, "sp_scaled", "% of PV span", kScaled, kHundredth),
    loop_in(Field::pv_scaled, 17, i16, "pv_scaled", "% of PV span", kScaled, kHundredth),
    loop_in(Field::co_scaled, 18, i16, "co_scaled", "% of CO span", kScaled, kHundredth),
    loop_in(Field::stem_scaled, 19, i16, "stem_scaled", "% of CO span", kScaled, kHundredth),
    loop_in(Field::pv_age, 20, u16, "pv_age", "ms", "age of PV; 65535: at least"),
    loop_in(Field::ne107, 21, u16, "ne107", "", "as in the box's block, of this loop"),
    loop_in(
        Field::loop_bits, 22, u16, "loop_bits", "",
        "1 output at its low end, 2 at its high end, 4 rate limited, 8 commands don't reach the "
        "device, 16 jacket acts, 32 read-back is there, 64 compensator acts"),
    loop_in(Field::variability, 23, u16, "variability", "% of PV span",
            "standard deviation of SP - PV in the newest window", kHundredth),
    loop_in(Field::mean_error, 24, i16, "mean_error", "% of PV span", "mean of SP - PV in it",
            kHundredth),
    loop_in(Field::oscillation_index, 25, u16, "oscillation_index", "",
            "regularity of PV's autocorrelation; above 1 it oscillates", kHundredth),
    loop_in(Field::oscillation_period, 26, f32, "oscillation_period", "s",
            "period of that oscillation; 0: no oscillation"),
    loop_in(Field::travel, 28, f32, "travel", "% of CO span/h", "path of the valve"),
    loop_in(Field::reversals, 30, f32, "reversals", "1/h", "of the valve's direction"),
    loop_in(Field::stick, 32, u16, "stick", "% of CO span",
            "CO's travel after a reversal before the valve follows; 0: not measured", kHundredth),
    loop_in(Field::stick_source, 33, u16, "stick_source", "",
            "of stick: 0 not measured, 1 from the read-back, 2 from PV and CO: an upper bound"),
    loop_in(Field::saturated, 34, u16, "saturated", "%", "share of the window with CO at an end",
            kHundredth),
    loop_in(Field::window_state, 35, u16, "window_state", "",
            "0 valid, 1 filling, 2 not automatic, 3 bad PV, 4 gap, 5 saturated, 6 not enough "
            "movement, 7 "
            "no specialists, 8 no set point"),
    loop_in(Field::window_number, 36, u32, "window_number", "",
            "windows looked at since the start"),
    loop_in(Field::window_severity, 38, u16, "window_severity", "% of CO span",
            "size of the fault in the newest window, at most the range that CO moved; 0: unknown",
            kHundredth),
    loop_in(Field::probability, 39, u16, "p_stiction", "%", kProbability, kHundredth, 0),
    loop_in(Field::probability, 40, u16, "p_backlash", "%", kProbability, kHundredth, 1),
    loop_in(Field::probability, 41, u16, "p_hysteresis", "%", kProbability, kHundredth, 2),
    loop_in(Field::probability, 42, u16, "p_low_air_supply", "%", kProbability, kHundredth, 3),
    loop_in(Field::probability, 43, u16, "p_unknown", "%", kProbability, kHundredth, 4),
    loop_in(Field::alarm_severity, 44, u16, "severity_stiction", "% of CO span", kSeverity,
            kHundredth, 0),
    loop_in(Field::alarm_severity, 45, u16, "severity_backlash", "% of CO span", kSeverity,
            kHundredth, 1),
    loop_in(Field::alarm_severity, 46, u16, "severity_hysteresis", "% of CO span", kSeverity,
            kHundredth, 2),
    loop_in(Field::alarm_severity, 47, u16, "severity_low_air_supply", "% of CO span", kSeverity,
            kHundredth, 3),
    loop_in(Field::alarm_severity, 48, u16, "severity_unknown", "% of CO span",
            "always 0: the size of an unknown fault is unknown", kHundredth, 4),
    loop_in(Field::alarm_state, 49, u16, "alarm_stiction", "", kState, 1.0, 0),
    loop_in(Field::alarm_state, 50, u16, "alarm_backlash", "", kState, 1.0, 1),
    loop_in(Field::alarm_state, 51, u16, "alarm_hysteresis", "", kState, 1.0, 2),
    loop_in(Field::alarm_state, 52, u16, "alarm_low_air_supply", "", kState, 1.0, 3),
    loop_in(Field::alarm_state, 53, u16, "alarm_unknown", "", kState, 1.0, 4),
    loop_in(Field::hours_automatic, 54, f32, "hours_automatic", "h",
            "in automatic since the start"),
    loop_in(Field::hours_manual, 56, f32, "hours_manual", "h", "in manual since the start"),
    loop_in(Field::hours_at_limit, 58, f32, "hours_at_limit", "h",
            "with CO at an end of its range since the start"),
    loop_in(Field::records_dropped, 60, u32, "records_dropped", "",
            "cycles that the recorder or the monitor dropped because it was too slow"),
    loop_in(
        Field::corrective_action, 62, u16, "corrective_action", "",
        "0 off, 1 waiting, 2 trying: jacket or planned moves act, 3 helping, 4 given up, 5 vetoed, "
        "6 planned moves are offered, 7 they are in shadow"),
    loop_in(Field::sequence_tail, 63, u16, "sequence_tail", "", "as sequence_head"),

    condition_in(
        0, "condition_control_performance",
        "100 good, 0 bad, -32768 unknown: RMS of SP - PV; does not distinguish tuning from valve"),
    condition_in(1, "condition_valve",
                 "the same: stick band, from the read-back or an alarm; otherwise unknown"),
    condition_in(2, "condition_actuator",
                 "the same: lag of the stem, low air; not known while neither shows"),
    condition_in(3, "condition_positioner", "the same: stem off CO, read-back bad"),
    condition_in(4, "condition_environment", "the same: PV bad, cycles late or not delivered"),

    holding(Field::master_heartbeat, Area::box, 0, u16, "master_heartbeat", "",
            "the master writes another number here at least every master_heartbeat.timeout"),
    holding(Field::wanted_mode, Area::loop, 0, u16, "mode", "", "0 manual, 1 automatic"),
    holding(Field::wanted_sp, Area::loop, 2, f32, "sp", "PV", "set point"),
    holding(Field::wanted_output, Area::loop, 4, f32, "output", "CO",
            "output, for manual; reads the present output as co does"),
    holding(Field::kp, Area::loop, 6, f32, "kp", "CO/PV", "proportional gain of the parallel form"),
    holding(Field::ki, Area::loop, 8, f32, "ki", "CO/(PV s)", "integral gain"),
    holding(Field::kd, Area::loop, 10, f32, "kd", "CO s/PV", "derivative gain"),
    holding(Field::wanted_sp_scaled, Area::loop, 12, i16, "sp_scaled", "% of PV span",
            "sp once more, 0.01 % of the span", kHundredth),
    holding(Field::wanted_output_scaled, Area::loop, 13, i16, "output_scaled", "% of CO span",
            "output once more, 0.01 % of the span", kHundredth),
    holding(Field::shelve_minutes, Area::loop, 14, u16, "shelve_stiction", "min", kShelve, 1.0, 0),
    holding(Field::shelve_minutes, Area::loop, 15, u16, "shelve_backlash", "min", kShelve, 1.0, 1),
    holding(Field::shelve_minutes, Area::loop, 16, u16, "shelve_hysteresis", "min", kShelve, 1.0,
            2),
    holding(Field::shelve_minutes, Area::loop, 17, u16, "shelve_low_air_supply", "min", kShelve,
            1.0, 3),
    holding(Field::shelve_minutes, Area::loop, 18, u16, "shelve_unknown", "min", kShelve, 1.0, 4),
    holding(Field::moves_phase, Area::loop, 19, u16, "moves_phase", "",
            "planned moves: 0 off, 1 watching the loop without them, 2 probing, 3 resting, 4 "
            "backing off, 5 moving, 6 disengaged"),
    holding(Field::moves_gain, Area::loop, 20, u16, "moves_gain", "",
            "ratio of the RMS of SP - PV with planned moves to that without; in shadow the "
            "predicted ratio; 0: unknown yet",
            0.01),
    holding(Field::jacket_rate, Area::third, 0, f32, "jacket_rate", "CO/s",
            "what the stickband jacket adds to the integral; 0 without one"),
    holding(Field::jacket_rate_shadow, Area::third, 2, f32, "jacket_rate_shadow", "CO/s",
            "what it asks for, whether it acts or not"),
    holding(Field::compensator, Area::third, 4, f32, "compensator", "CO",
            "what the compensator adds to the output; 0 without one"),
    holding(Field::compensator_shadow, Area::third, 6, f32, "compensator_shadow", "CO",
            "what it asks for, whether it acts or not"),
    holding(Field::orders_refused, Area::third, 8, u16, "orders_refused", "",
            "commands from any source that were accepted but could not act when the loop took "
            "them; 65535: at least"),
    holding(Field::calm, Area::third, 9, u16, "calm_stiction", "",
            "write 1: start the offered planned moves, in shadow first; a repeated 1 starts them "
            "once; reads 0"),
    holding(Field::alarm_state, Area::third, 10, u16, "alarm_model_gap", "", kState, 1.0, 5),
    holding(Field::shelve_minutes, Area::third, 13, u16, "shelve_model_gap", "min", kShelve, 1.0,
            5),
    holding(Field::unshelve_process, Area::third, 14, u16, "unshelve_process", "",
            "write 1: unshelve all process alarms of the loop; reads 0"),
    holding(Field::explanation_effect, Area::third, 16, u16, "explanation_effect", "",
            "number of the effect (effects.md) that explains the alarm, from the newest "
            "explanation; 0: no explanation"),
    holding(Field::explanation_agrees, Area::third, 17, u16, "explanation_agrees", "",
            "1: the explanation agrees with the alarm's name, or gave it; 2: it does not agree; 0: "
            "no explanation"),
    holding(Field::explanation_size, Area::third, 18, f32, "explanation_size", "% of CO span",
            "size of that effect; 0: the effect has no single size"),
    holding(Field::explanation_low, Area::third, 20, f32, "explanation_low", "% of CO span",
            "interval of the size"),
    holding(Field::explanation_high, Area::third, 22, f32, "explanation_high", "% of CO span",
            "interval of the size"),
    holding(Field::explanation_gap_closed, Area::third, 24, i16, "explanation_gap_closed", "%",
            "share of the gap to the twin that the effect closes; -327.68: unknown", 0.01),
    holding(Field::explanation_alarm, Area::third, 25, u16, "explanation_alarm", "",
            "the alarm that is explained: 1 stiction, 2 backlash, 3 hysteresis, 4 low_air_supply, "
            "5 unknown, 6 model_gap; 0: no explanation"),
    holding(Field::explanation_age, Area::third, 26, u32, "explanation_age", "s",
            "since the explanation was found"),
    holding(Field::process_active, Area::third, 28, u16, "process_active", "",
            "process alarms whose condition is on, bits as alarms.md has them: 1 bad_pv, "
            "2 output_lost, 4 output_unknown, 8 not_normal_mode, 16 enable_open, 32 source_lost, "
            "64 deviation, 128 pv_high_high, 256 pv_high, 512 pv_low, 1024 pv_low_low, "
            "2048 rate_of_change"),
    holding(Field::process_unacknowledged, Area::third, 29, u16, "process_unacknowledged", "",
            "the same bits: they wait for the operator"),
    holding(Field::process_shelved, Area::third, 30, u16, "process_shelved", "",
            "the same bits: shelved"),
    holding(Field::process_suppressed, Area::third, 31, u16, "process_suppressed", "",
            "the same bits: suppressed by design"),

    box_bit(Field::running, 0, "running", "the loops run"),
    box_bit(Field::any_alarm_active, 1, "any_alarm_active", "the condition of an alarm is on"),
    box_bit(Field::any_alarm_unacknowledged, 2, "any_alarm_unacknowledged",
            "an alarm waits for the operator"),
    box_bit(Field::writes_enabled, 3, "writes_enabled", "masters on the list may write"),
    box_bit(Field::any_simulated, 4, "any_simulated", "a loop is simulated or replayed"),
    box_bit(Field::master_lost, 5, "master_lost", "the master's heartbeat has stopped"),
    box_bit(Field::journal_trouble, 6, "journal_trouble", "the journal can't write"),
    box_bit(Field::no_real_time_rights, 7, "no_real_time_rights",
            "other load on the host may delay the loops"),
    loop_bit(Field::alarm_active, 0, "active_stiction", kActive, 0),
    loop_bit(Field::alarm_active, 1, "active_backlash", kActive, 1),
    loop_bit(Field::alarm_active, 2, "active_hysteresis", kActive, 2),
    loop_bit(Field::alarm_active, 3, "active_low_air_supply", kActive, 3),
    loop_bit(Field::alarm_active, 4, "active_unknown", kActive, 4),
    loop_bit(Field::alarm_unacknowledged, 5, "unacknowledged_stiction", kWaits, 0),
    loop_bit(Field::alarm_unacknowledged, 6, "unacknowledged_backlash", kWaits, 1),
    loop_bit(Field::alarm_unacknowledged, 7, "unacknowledged_hysteresis", kWaits, 2),
    loop_bit(Field::alarm_unacknowledged, 8, "unacknowledged_low_air_supply", kWaits, 3),
    loop_bit(Field::alarm_unacknowledged, 9, "unacknowledged_unknown", kWaits, 4),
    loop_bit(Field::pv_bad, 10, "pv_bad", "PV is bad"),
    loop_bit(Field::at_low, 11, "at_low", "the output is at its low end"),
    loop_bit(Field::at_high, 12, "at_high", "the output is at its high end"),
    loop_bit(Field::in_manual, 13, "in_manual", "the loop is in manual"),
    loop_bit(Field::any_suppressed, 14, "any_suppressed", "an alarm is suppressed by design"),
    loop_bit(Field::any_shelved, 15, "any_shelved", "an alarm is shelved"),
    loop_bit(Field::communication_lost, 16, "communication_lost",
             "commands don't reach the device"),
    loop_bit(Field::in_fault, 17, "in_fault", "the loop has a fault"),
    loop_bit(Field::window_valid, 18, "window_valid", "the newest window could be judged"),

    bit(Field::acknowledge_all, Table::coil, Area::box, 0, "acknowledge_all",
        "write 1: acknowledge every loop's alarms of this map; reads 0"),
    loop_coil(Field::acknowledge, 0, "acknowledge_stiction", kAcknowledge, 0),
    loop_coil(Field::acknowledge, 1, "acknowledge_backlash", kAcknowledge, 1),
    loop_coil(Field::acknowledge, 2, "acknowledge_hysteresis", kAcknowledge, 2),
    loop_coil(Field::acknowledge, 3, "acknowledge_low_air_supply", kAcknowledge, 3),
    loop_coil(Field::acknowledge, 4, "acknowledge_unknown", kAcknowledge, 4),
    loop_coil(Field::reset, 5, "reset_stiction", kReset, 0),
    loop_coil(Field::reset, 6, "reset_backlash", kReset, 1),
    loop_coil(Field::reset, 7, "reset_hysteresis", kReset, 2),
    loop_coil(Field::reset, 8, "reset_low_air_supply", kReset, 3),
    loop_coil(Field::reset, 9, "reset_unknown", kReset, 4),
    loop_coil(Field::unshelve, 10, "unshelve_stiction", kUnshelve, 0),
    loop_coil(Field::unshelve, 11, "unshelve_backlash", kUnshelve, 1),
    loop_coil(Field::unshelve, 12, "unshelve_hysteresis", kUnshelve, 2),
    loop_coil(Field::unshelve, 13, "unshelve_low_air_supply", kUnshelve, 3),
    loop_coil(Field::unshelve, 14, "unshelve_unknown", kUnshelve, 4),
    loop_coil(Field::veto_corrective_action, 15, "veto_corrective_action",
              "write 1: the jacket returns to shadow and stays there, and planned moves end; write "
              "0: they may act again; reads the present setting",
              0),
    bit(Field::acknowledge, Table::coil, Area::third, 0, "acknowledge_model_gap", kAcknowledge, 5),
    bit(Field::reset, Table::coil, Area::third, 1, "reset_model_gap", kReset, 5),
    bit(Field::unshelve, Table::coil, Area::third, 2, "unshelve_model_gap", kUnshelve, 5),
    bit(Field::acknowledge_process, Table::coil, Area::third, 3, "acknowledge_process",
        "write 1: acknowledge all process alarms of the loop; reads 0"),
};

constexpr std::array kReserved{
    Reserved{Table::holding_register, 11, 1,
             "severity_model_gap (u16): its size, 0.01 % of the CO span"},
    Reserved{Table::holding_register, 12, 1, "p_model_gap (u16): its probability, 0.01 %"},
};

constexpr std::uint16_t width_of(RegisterType type) {
  return type == RegisterType::u32 || type == RegisterType::f32 ? 2 : 1;
}

constexpr int size_of(const Layout& l, Area area) {
  switch (area) {
    case Area::loop: return l.loop_stride;
    case Area::condition: return l.condition_stride;
    case Area::third: return l.third_stride;
    case Area::box: break;
  }
  return l.box_size;
}

// Returns whether each field is inside its block and no two fields overlap. The compiler checks it.
constexpr bool sound() {
  for (std::size_t i = 0; i < kRegisters.size(); ++i) {
    const Register& a = kRegisters[i];
    const Layout l = layout(a.table);
    const int size = size_of(l, a.area);
    if (a.offset + width_of(a.type) > size) return false;
    for (std::size_t k = 0; k < i; ++k) {
      const Register& b = kRegisters[k];
      if (a.table != b.table || a.area != b.area) continue;
      if (a.offset < b.offset + width_of(b.type) && b.offset < a.offset + width_of(a.type)) {
        return false;
      }
    }
  }
  return true;
}
static_assert(sound());

// Returns whether each reserved place is inside its block and outside every register.
constexpr bool reservations_hold() {
  for (const Reserved& place : kReserved) {
    if (place.offset + place.words > layout(place.table).third_stride) return false;
    for (const Register& reg : kRegisters) {
      if (reg.table != place.table || reg.area != Area::third) continue;
      if (reg.offset < place.offset + place.words &&
          place.offset < reg.offset + width_of(reg.type)) {
        return false;
      }
    }
  }
  return true;
}
static_assert(reservations_hold());
static_assert(layout(Table::input_register).first_condition + 8U * kMostLoops <= 0x10000);
// Returns whether the third blocks follow the first blocks of all loops and end within the 16-bit
// addresses.
constexpr bool thirds_fit(Table table) {
  const Layout l = layout(table);
  return l.first_loop + l.loop_stride * kMostLoops <= l.first_third &&
         l.first_third + l.third_stride * kMostLoops <= 0x10000;
}
static_assert(thirds_fit(Table::holding_register) && thirds_fit(Table::coil));

// Index into kRegisters plus 1, by table, area and offset. 0: reserved.
constexpr std::size_t kLargestBlock = 64;
using Index = std::array<std::array<std::array<std::uint8_t, kLargestBlock>, kAreas>, kTables>;
static_assert(kRegisters.size() < 255);
constexpr Index make_index() {
  Index index{};
  for (std::size_t i = 0; i < kRegisters.size(); ++i) {
    const Register& reg = kRegisters[i];
    auto& block = index[static_cast<std::size_t>(reg.table)][static_cast<std::size_t>(reg.area)];
    for (std::uint16_t w = 0; w < width_of(reg.type); ++w) {
      block[static_cast<std::size_t>(reg.offset + w)] = static_cast<std::uint8_t>(i + 1);
    }
  }
  return index;
}
constexpr Index kIndex = make_index();

}  // namespace

const char* to_text(Table table) noexcept {
  switch (table) {
    case Table::input_register: return "input register";
    case Table::holding_register: return "holding register";
    case Table::discrete_input: return "discrete input";
    case Table::coil: break;
  }
  return "coil";
}

std::span<const Register> registers() noexcept { return kRegisters; }
std::span<const Reserved> reserved() noexcept { return kReserved; }

std::uint16_t width(const Register& reg) noexcept { return width_of(reg.type); }

Place find(Table table, std::uint32_t address, std::size_t loops) noexcept {
  const Layout l = layout(table);
  Place place;
  std::size_t offset = address;
  Area area = Area::box;
  const auto in_block_of_loop = [&](Area of, std::uint16_t first, std::uint16_t stride) {
    if (stride == 0 || address < first) return false;
    area = of;
    place.loop = (address - first) / stride;
    offset = (address - first) % stride;
    return true;
  };
  // Searches from the highest block to the lowest. The loops' first blocks are the lowest.
  if (in_block_of_loop(Area::condition, l.first_condition, l.condition_stride) ||
      in_block_of_loop(Area::third, l.first_third, l.third_stride) ||
      in_block_of_loop(Area::loop, l.first_loop, l.loop_stride)) {
    if (place.loop >= loops || place.loop >= kMostLoops) return {};
  } else if (address >= l.box_size) {
    return {};
  }
  place.in_map = true;
  const std::uint8_t found =
      kIndex[static_cast<std::size_t>(table)][static_cast<std::size_t>(area)][offset];
  if (found == 0) return place;
  place.reg = &kRegisters[found - 1U];
  place.word = static_cast<std::uint16_t>(offset - place.reg->offset);
  return place;
}

}  // namespace loopwarden::registers
