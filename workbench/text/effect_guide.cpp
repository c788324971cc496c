// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/effect_guide.hpp"

#include <array>

namespace loopwarden::workbench {
namespace {

constexpr std::array kStiction{
    LookAlike{"backlash",
              "moves on smoothly once the play is taken up; a jump after the rest is stiction. It "
              "takes about four slips to tell."},
    LookAlike{"cam_obstruction", "sticks at one opening only; stiction sticks wherever CO turns."},
    LookAlike{"oscillating_disturbance",
              "CO-PV draws a smooth ellipse, and the model driven by the measured CO lacks a pure "
              "sine; with stiction it parts from PV at the slips."},
    LookAlike{"tight tuning", "leaves no gap: the model oscillates as the loop does."},
    LookAlike{"a valve that never moved",
              "until the first slip, stuck and at the end of its travel are the same."}};

constexpr std::array kBacklash{
    LookAlike{"stiction", "jumps after the rest; backlash does not."},
    LookAlike{"extra_dead_time",
              "delays every move by the same time; backlash delays reversals only, and less the "
              "faster CO moves: deadband divided by the rate of CO."},
    LookAlike{"hysteresis", "(`width`) has round corners and loses less on a small reversal."}};

constexpr std::array kHysteresis{
    LookAlike{
        "backlash",
        "sharp corners, and the same loss on every reversal, large or small: reversals of two "
        "sizes tell."},
    LookAlike{"valve_characteristic", "also bends, but is the same curve up and down."}};

constexpr std::array kLowAir{
    LookAlike{
        "extra_lag",
        "twice the step moves twice as fast; a starved actuator has one speed for all steps."},
    LookAlike{"extra_dead_time", "shifts PV without changing its slope."},
    LookAlike{"stiction", "rests at any opening; a supply that is too low stops at the same top."}};

constexpr std::array kCharacteristic{
    LookAlike{"gain_change",
              "one factor at every opening. CO has to move over about a tenth of its range before "
              "the two part."},
    LookAlike{"output_bias", "the same offset at every opening."},
    LookAlike{"hysteresis", "another curve up than down; a characteristic has one."}};

constexpr std::array kCam{
    LookAlike{"stiction", "sticks wherever CO turns, not at one opening."},
    LookAlike{"valve_characteristic",
              "a flat and a steep stretch, but passed at the same CO both ways."}};

constexpr std::array kOvershoot{
    LookAlike{"extra_dead_time",
              "a residual of one sign after a move; overshoot changes its sign."},
    LookAlike{"tight tuning",
              "CO rings as well, and the model reproduces it; here PV rings after each move of CO "
              "by itself."}};

constexpr std::array kPositioner{
    LookAlike{"backlash",
              "loses the same on a reversal but never overshoots; here a large step overshoots and "
              "comes to rest within the dead band."},
    LookAlike{"positioner_overshoot",
              "rings after small moves as after large ones and leaves nothing behind."},
    LookAlike{"stiction", "jumps after the rest, at any opening; a positioner creeps on."}};

constexpr std::array kPositionerLag{
    LookAlike{"extra_lag",
              "the same from CO to PV: linear lags in a row can't be told apart by their order. A "
              "measured stem tells."},
    LookAlike{"low_air_supply", "one speed for all steps; a lag is faster for a larger step."},
    LookAlike{"extra_dead_time", "PV keeps its shape; a lag rounds it."}};

constexpr std::array kGain{
    LookAlike{"valve_characteristic",
              "the factor changes with the opening: try a wider range of CO."},
    LookAlike{"output_bias",
              "a constant offset. While CO stays near one value the two are the same."},
    LookAlike{"step_disturbance", "comes on at one moment."}};

constexpr std::array kDeadTime{
    LookAlike{"extra_lag",
              "the same area under the residual, but long and round; dead time leaves a short one "
              "with the slope of PV."},
    LookAlike{"backlash", "delays reversals only, and by less the faster CO moves."},
    LookAlike{"positioner_overshoot", "the residual changes its sign."},
    LookAlike{"clocks that differ",
              "CO and PV recorded a sample apart look like a sample of dead time."}};

constexpr std::array kLag{
    LookAlike{"extra_dead_time", "see there."},
    LookAlike{"positioner_lag", "the same from CO to PV; a measured stem tells."},
    LookAlike{
        "a longer time constant",
        "within the stated uncertainty of the process it is no effect; beyond it one more lag "
        "starts more gently than one longer lag."}};

constexpr std::array kBias{
    LookAlike{"a constant load", "can't be told apart by any record."},
    LookAlike{"gain_change", "grows with the distance from the calibration point."},
    LookAlike{"step_disturbance", "starts within the record."},
    LookAlike{"drift", "grows with time."}};

constexpr std::array kDrift{
    LookAlike{"random_load", "wanders back; a drift never does."},
    LookAlike{"step_disturbance", "comes on within moments."},
    LookAlike{"output_bias", "does not grow. A short record can't tell a slow drift from it."}};

constexpr std::array kSine{
    LookAlike{"stiction",
              "the model parts from PV in corners at the slips, with odd harmonics; a disturbance "
              "is one line of the spectrum."},
    LookAlike{"tight tuning", "the model oscillates as well: there is no gap."},
    LookAlike{"random_load", "has no fixed period."}};

constexpr std::array kStep{LookAlike{"output_bias", "was there from the start."},
                           LookAlike{"gain_change", "follows CO; a load stays when CO moves."},
                           LookAlike{"stiction", "its jumps come back, and only while CO moves."}};

constexpr std::array kRandomLoad{
    LookAlike{"drift", "goes one way at one rate."}, LookAlike{"output_bias", "constant."},
    LookAlike{
        "every other effect",
        "a load that wanders hides what is smaller than itself, and with a constant set point "
        "it feeds back into CO: bias, gain and lags can't be named then."}};

constexpr std::array kController{
    LookAlike{"every effect of valve and process",
              "changes PV for the same CO; another tuning changes CO for the same SP and PV."},
    LookAlike{"another anti-windup",
              "CO differs only at and after its limits: that is no mismatch of the tuning."}};

constexpr std::array kGuides{
    EffectGuide{
        "stiction",
        "CO winds up while PV stands still, then PV jumps and stands again: in a flow loop "
        "CO is a triangle and PV nearly square. Stem over CO is a parallelogram with jumps.",
        kStiction},
    EffectGuide{"backlash",
                "After each reversal of CO nothing moves until CO has come back by the deadband; "
                "then PV follows smoothly. The residual has the sign of the last move.",
                kBacklash},
    EffectGuide{
        "hysteresis",
        "Another branch on the way down than on the way up. With `offset` the flow steps by "
        "it whenever CO turns; with `width` the branches part gradually, and small "
        "reversals draw small loops.",
        kHysteresis},
    EffectGuide{
        "low_air_supply",
        "The stem moves at one rate however far it has to go, and may stop short of what CO "
        "asks for; CO winds up meanwhile. With `one_sided` filling it closes as it should.",
        kLowAir},
    EffectGuide{"valve_characteristic",
                "The loop is lively at one end of its range and dull at the other. The residual "
                "bends with the opening, the same up and down.",
                kCharacteristic},
    EffectGuide{
        "cam_obstruction",
        "Good everywhere but at one opening: there PV stands, then jumps, on the way up and "
        "on the way down.",
        kCam},
    EffectGuide{"positioner_overshoot", "PV rings after each move of CO, with a period of its own.",
                kOvershoot},
    EffectGuide{"positioner",
                "Small moves of CO are ignored, large ones overshoot, and the stem rests anywhere "
                "within the dead band. With `breakaway` a shut valve opens late.",
                kPositioner},
    EffectGuide{"positioner_lag",
                "PV comes late and rounded after each move of CO, in proportion to the move; the "
                "residual dies out exponentially.",
                kPositionerLag},
    EffectGuide{"gain_change",
                "PV moves too far or not far enough, by the same factor for every move. The "
                "residual is a straight line over CO.",
                kGain},
    EffectGuide{"extra_dead_time",
                "PV keeps its shape and comes later. The residual is a short pulse at each move of "
                "CO, in both directions, whatever the size. A tight loop swings more.",
                kDeadTime},
    EffectGuide{"extra_lag",
                "PV comes late and rounded; in the transmitter it also smooths the noise. A "
                "tight loop swings more.",
                kLag},
    EffectGuide{"output_bias",
                "The same loop at another CO: PV is off by a constant for the same CO.", kBias},
    EffectGuide{"drift",
                "At a constant set point CO creeps: the controller makes up for what the "
                "transmitter loses.",
                kDrift},
    EffectGuide{"oscillating_disturbance",
                "PV and CO swing with a steady period that is not the loop's own; the model driven "
                "by the measured CO lacks a sine.",
                kSine},
    EffectGuide{"step_disturbance",
                "From one moment on PV is off; the controller brings it back with another CO.",
                kStep},
    EffectGuide{"random_load", "PV and CO wander without a pattern, over minutes.", kRandomLoad},
    EffectGuide{
        "controller_mismatch",
        "The model's controller, given the measured SP and PV, gives another CO; from CO to "
        "PV there is no gap.",
        kController},
};

}  // namespace

std::span<const EffectGuide> effect_guides() noexcept { return kGuides; }

const EffectGuide* find_guide(std::string_view name) noexcept {
  for (const EffectGuide& guide : kGuides) {
    if (guide.name == name) return &guide;
  }
  return nullptr;
}

}  // namespace loopwarden::workbench
