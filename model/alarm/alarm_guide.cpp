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
     "Plan the valve's repair. Until then reduce the cycling with planned moves or a slower "
     "controller",
     "weeks: with the next planned work"},
    // backlash
    {"Backlash between stem and plug or in the linkage",
     "The valve answers late after each reversal. The loop may cycle slowly",
     "Have linkage and stem connection checked at the next stop",
     "weeks: with the next planned work"},
    // hysteresis
    {"Friction or a worn diaphragm: the valve's position depends on the direction of travel",
     "The flow differs with the direction of travel",
     "Check packing, diaphragm and positioner calibration at the next stop",
     "weeks: with the next planned work"},
    // low_air_supply
    {"The actuator gets too little air: regulator, filter, leak, compressor",
     "The valve moves slowly and does not reach its full travel",
     "Check the supply pressure at the valve now. This alarm suppresses the valve's other alarms",
     "an hour"},
    // unknown
    {"The valve answers neither like a healthy one nor like any fault in the catalogue",
     "The loop's quality is not assured",
     "Look at the trend. Compare with `loopwarden gap` or `loopwarden diagnose`", "a day"},
    // model_gap
    {"The loop no longer behaves as when it was commissioned: valve, process, transmitter or load",
     "Its tuning may not fit any more, and the specialists were trained for another loop",
     "Find the change before you tune the loop again. The explanation by the twin names it. "
     "Without an explanation, check valve, transmitter and load",
     "a day"},
    // bad_pv
    {"PV can't be used: its transmitter, its wiring or the link to it has failed. The journal has "
     "the reason",
     "The loop can't control. The output takes the action of `safe_actions.bad_pv`; with a frozen "
     "PV only if the file has `frozen_after`",
     "Watch the process by another measurement. Check transmitter, wiring and link",
     "minutes: PV is not controlled"},
    // output_lost
    {"Commands don't reach the valve: the device, its power or the link to it has failed",
     "The valve is not controlled. The device's own watchdog may have moved it",
     "Look at the valve. Check the device, its power and the link", "at once"},
    // output_unknown
    {"The position of the output is unknown: there is no read-back, or it is bad",
     "The loop does not write to the valve, whatever its mode",
     "Set the output manually (`loopwarden set --mode man --output`), or repair the read-back",
     "minutes: PV is not controlled"},
    // not_normal_mode
    {"An operator, a master or a fault has taken the loop out of its normal mode",
     "In manual or fallback the valve keeps its position, and PV is not controlled",
     "Find the reason. Return the loop to its normal mode when it is safe", "the shift"},
    // enable_open
    {"The enable contact of the loop is open: a switch, an interlock, or its wiring",
     "The loop does not control. The output takes the action of `safe_actions.enable_open`",
     "Find out who opened it and why before it is closed again", "minutes: PV is not controlled"},
    // source_lost
    {"The source of this watched loop's values is silent: feeder, link or the other controller",
     "The state of the loop is unknown here. The other controller continues by itself",
     "Look at the other controller's own display. Check feeder, link and network", "an hour"},
    // deviation
    {"PV stays off its set point: a load beyond the valve's range, a valve that does not move, "
     "tuning",
     "The product is off its target",
     "Look at PV, CO and valve. With the valve at a limit the load is too large. Otherwise check "
     "the valve and the tuning",
     "ten minutes"},
    // pv_high_high
    {"PV is far above the limit of the process",
     "The plant's own protection trips, or damage follows", "Lower PV manually now", "at once"},
    // pv_high
    {"PV is above its normal range", "PV approaches the high-high limit",
     "Check the set point and the causes of a high PV. Reduce the load", "ten minutes"},
    // pv_low
    {"PV is below its normal range", "PV approaches the low-low limit",
     "Check the set point and the causes of a low PV. Check for a loss of supply", "ten minutes"},
    // pv_low_low
    {"PV is far below the limit of the process",
     "The plant's own protection trips, or damage follows", "Raise PV manually now", "at once"},
    // rate_of_change
    {"PV changes faster than the process does by itself: a rupture, a blockage, a failing "
     "transmitter",
     "The loop may not follow, and PV passes its limits soon",
     "Compare with a second measurement. Take the loop to manual if the transmitter has failed",
     "minutes"},
}};

}  // namespace

AlarmGuide guide_of(AlarmKind kind) noexcept { return kGuides[index_of(kind)]; }

}  // namespace loopwarden::alarm
