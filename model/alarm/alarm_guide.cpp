// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm_guide.hpp"

#include <array>

namespace loopwarden::alarm {
namespace {

// In the order of AlarmKind.
constexpr std::array<AlarmGuide, kAlarmKindCount> kGuides{{
    // stiction
    {"the stem sticks and jumps: packing too tight, deposits, a worn seat",
     "the loop cycles around its set point and wears the valve",
     "plan the valve's repair; until then planned moves or a slower controller calm the loop",
     "weeks: with the next planned work"},
    // backlash
    {"play between stem and plug or in the linkage",
     "the valve answers late after each reversal; the loop may cycle slowly",
     "have linkage and stem connection checked at the next stop",
     "weeks: with the next planned work"},
    // hysteresis
    {"friction or a worn diaphragm: the valve stands elsewhere going up than coming down",
     "the flow differs with the direction of travel",
     "check packing, diaphragm and positioner calibration at the next stop",
     "weeks: with the next planned work"},
    // low_air_supply
    {"the actuator gets too little air: regulator, filter, leak, compressor",
     "the valve moves slowly and does not reach its full travel",
     "check the supply pressure at the valve now; other alarms of this valve wait for it",
     "an hour"},
    // unknown
    {"the valve does not answer as a healthy one, nor as any fault that is known here",
     "the loop's quality is not assured",
     "look at the trend; compare with `loopwarden gap` or `loopwarden diagnose`", "a day"},
    // model_gap
    {"the loop no longer behaves as when it was commissioned: valve, process, transmitter or load",
     "its tuning may not fit any more, and the specialists know another loop",
     "find what has changed before the loop is tuned anew: the explanation by the twin names it; "
     "without one, check valve, transmitter and load",
     "a day"},
    // bad_pv
    {"PV can't be used: its transmitter, its wiring or the link to it has failed; the journal's "
     "line has the reason",
     "the loop can't control; the output does what `safe_actions.bad_pv` says; with a frozen PV "
     "only if the file has `frozen_after`",
     "watch the process by another measurement; check transmitter, wiring and link",
     "minutes: nothing controls PV"},
    // output_lost
    {"commands don't reach the valve: the device, its power or the link to it has failed",
     "nobody moves the valve; the device's own watchdog may have moved it",
     "look at the valve; check the device, its power and the link", "at once"},
    // output_unknown
    {"nothing tells where the output stands: there is no read-back, or it is bad",
     "the loop writes nothing to the valve, whatever its mode",
     "set the output by hand (`loopwarden set --mode man --output`), or mend the read-back",
     "minutes: nothing controls PV"},
    // not_normal_mode
    {"an operator, a master or a fault has taken the loop out of its normal mode",
     "in manual or fallback the valve stays where it is, and nothing controls PV",
     "find out why; put the loop back into its normal mode once nothing speaks against it",
     "the shift"},
    // enable_open
    {"the enable contact of the loop is open: a switch, an interlock, or its wiring",
     "the loop does not control; the output does what `safe_actions.enable_open` says",
     "find out who opened it and why before it is closed again", "minutes: nothing controls PV"},
    // source_lost
    {"what brings the values of this watched loop is silent: feeder, link or the other controller",
     "nothing is known of the loop here; the other controller goes on by itself",
     "look at the other controller's own display; check feeder, link and network", "an hour"},
    // deviation
    {"PV stays off its set point: a load that the valve can't answer, a valve that does not move, "
     "tuning",
     "the product is off its target",
     "look at PV, CO and valve: at a limit the load is too large, else the valve or the tuning",
     "ten minutes"},
    // pv_high_high
    {"PV is far above what the process bears",
     "the plant's own protection trips, or damage follows", "bring PV down by hand now", "at once"},
    // pv_high
    {"PV is above its normal range", "it comes nearer to the high-high limit",
     "check the set point and what drives PV; take the load back", "ten minutes"},
    // pv_low
    {"PV is below its normal range", "it comes nearer to the low-low limit",
     "check the set point and what drives PV; check for a loss of supply", "ten minutes"},
    // pv_low_low
    {"PV is far below what the process bears",
     "the plant's own protection trips, or damage follows", "bring PV up by hand now", "at once"},
    // rate_of_change
    {"PV changes faster than the process does by itself: a rupture, a blockage, a failing "
     "transmitter",
     "the loop may not follow, and PV passes its limits soon",
     "compare with a second measurement; take the loop to manual if the transmitter is to blame",
     "minutes"},
}};

}  // namespace

AlarmGuide guide_of(AlarmKind kind) noexcept { return kGuides[index_of(kind)]; }

}  // namespace loopwarden::alarm
