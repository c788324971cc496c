// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm_guide.hpp"

#include <array>

namespace loopwarden::alarm {
namespace {

// In the order of AlarmKind.
constexpr std::array<AlarmGuide, kAlarmKindCount> kGuides{{
    // stiction
    {"The stem sticks and jumps: packing too tight, deposits, a worn seat",
     "The loop cycles around its set point and wears the valve",
     "Plan the repair of the valve. Until then, planned moves can reduce the cycling, if the loop "
     "file has them",
     "weeks (next planned work)"},
    // backlash
    {"Backlash between stem and plug or in the linkage",
     "The valve responds late after each reversal. The loop may cycle slowly",
     "Check the linkage and the stem connection at the next stop", "weeks (next planned work)"},
    // hysteresis
    {"Friction or a worn diaphragm: the valve position depends on the direction of travel",
     "The flow differs with the direction of travel",
     "Check packing, diaphragm and positioner calibration at the next stop",
     "weeks (next planned work)"},
    // low_air_supply
    {"The actuator gets too little air: regulator, filter, leak, compressor",
     "The valve moves slowly and does not reach its full travel",
     "Check the supply pressure at the valve now. This alarm suppresses the other alarms of the "
     "valve",
     "1 hour"},
    // unknown
    {"Valve fault of unknown type: the response differs from a healthy valve and matches no known "
     "fault",
     "The quality of control is uncertain",
     "Check the trend of the loop. Run `loopwarden diagnose` or `loopwarden gap` on its record",
     "1 day"},
    // model_gap
    {"The loop differs from its commissioned state: valve, process, transmitter or disturbance",
     "The tuning may no longer fit, and valve alarms may be wrong",
     "Find the cause before you tune the loop again. See the explanation by the twin. Without an "
     "explanation, check valve, transmitter and disturbances",
     "1 day"},
    // bad_pv
    {"PV can't be used: its transmitter, its wiring or the link to it has failed. The journal has "
     "the reason",
     "In automatic the loop can't control, and the output takes the action of "
     "`safe_actions.bad_pv`. With a frozen PV it does so only if the file has `frozen_after`",
     "Watch the process by another measurement. Check transmitter, wiring and link",
     "minutes (PV is not controlled)"},
    // output_lost
    {"Commands don't reach the valve: the device, its power or the link to it has failed",
     "The valve is not controlled. The watchdog of the device may have moved it",
     "Check the valve in the plant. Check the device, its power and the link", "1 minute"},
    // output_unknown
    {"The position of the output is unknown: no read-back is configured, or the read-back is bad",
     "The loop does not write to the valve, whatever its mode",
     "Check the position of the valve in the plant. Repair the read-back, or set the output in "
     "manual: the valve moves to this value at once",
     "minutes (PV is not controlled)"},
    // not_normal_mode
    {"An operator, a master or a fault has taken the loop out of its normal mode",
     "In manual the output stays, and PV is not controlled. In fallback the output holds, or moves "
     "to the value in `safe_actions`",
     "Find the reason. Return the loop to its normal mode when it is safe", "this shift"},
    // enable_open
    {"The enable contact of the loop is open: a switch, an interlock, or its wiring",
     "The loop does not control. The output takes the action of `safe_actions.enable_open`",
     "Find out who opened it and why. Close it only after that", "minutes (PV is not controlled)"},
    // source_lost
    {"The source of this watched loop sends no values: feeder, link or the other controller",
     "The state of the loop is unknown here. The other controller continues by itself",
     "Check the display of the other controller. Check feeder, link and network", "1 hour"},
    // deviation
    {"PV stays off its set point: a disturbance beyond the range of the valve, a valve that does "
     "not move, or the tuning",
     "The product is off its target",
     "Check PV, CO and valve. If the valve is at a limit, reduce the disturbance. Otherwise check "
     "the valve and the tuning",
     "10 minutes"},
    // pv_high_high
    {"PV is far above the limit of the process",
     "The plant's protection may trip, or equipment may be damaged",
     "Lower PV now, in manual at the controller of the loop. For a watched loop this is the DCS or "
     "PLC",
     "1 minute"},
    // pv_high
    {"PV is above its normal range", "PV approaches the high-high limit",
     "Check the set point and the disturbances that raise PV. Remove the cause", "10 minutes"},
    // pv_low
    {"PV is below its normal range", "PV approaches the low-low limit",
     "Check the set point and the disturbances that lower PV. Check for a loss of supply",
     "10 minutes"},
    // pv_low_low
    {"PV is far below the limit of the process",
     "The plant's protection may trip, or equipment may be damaged",
     "Raise PV now, in manual at the controller of the loop. For a watched loop this is the DCS or "
     "PLC",
     "1 minute"},
    // rate_of_change
    {"PV changes faster than the process can: a rupture, a blockage, a failing transmitter",
     "The loop may not follow, and PV may soon pass its limits",
     "Compare PV with a second measurement. If the transmitter has failed, change the loop to "
     "manual",
     "minutes"},
}};

constexpr AlarmGuide kWatchedBadPv{
    "PV that arrives here can't be used: its transmitter or its wiring has failed, or the source "
    "reports it as bad. The journal has the reason",
    "Loopwarden can't judge the loop. The other controller may not have this PV either: its own "
    "display shows what it does",
    "Check the loop on the display of its controller. Check transmitter and wiring", "10 minutes"};

}  // namespace

AlarmGuide guide_of(AlarmKind kind, bool watched) noexcept {
  if (watched && kind == AlarmKind::bad_pv) return kWatchedBadPv;
  return kGuides[index_of(kind)];
}

}  // namespace loopwarden::alarm
