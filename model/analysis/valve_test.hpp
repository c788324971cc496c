// SPDX-License-Identifier: Apache-2.0
// Tests of a valve with the loop in manual: what CO does, and what the positions recorded then say.
//
//   step_change   one step up, one down: dead time, T63, T86, overshoot
//   stepped_ramp  ten steps of 1 % up, ten down: how many the valve answers, and its worst lag behind CO
//   step_study    at sizes of 0.1, 0.2, 0.5, 1, 2, 5 % of the range a step on in the direction of the last
//                 move, then one back: resolution is the least size that moves the stem onwards, dead band
//                 the least that moves it back; infinite where none does
//   static_scan   21 points up and down, each held: hysteresis with dead band (greatest distance between
//                 the branches in % of the range), dead band (their median distance over CO), linearity
//   dynamic_scan  a slow ramp up and down, the valve's signature: the same, and the distance along CO
//   sine          sines at 1/64 to 1/8 Hz about mid range: gain, and phase in degrees
//
// A plan is a list of outputs and how long to hold each. Every output lies within [low, high] of the
// settings. Positions are in CO units: the read-back, or (PV - PV at the start)/gain + CO at the start.
// A stem has moved when the mean of the last third of a hold is by more than `moved` from the one before.
//
// Limits: without a read-back the process is in the answer; lags are then its own, and PV's noise
// sets what counts as moved.
//
// Sources: ISA-75.25.01 (2000) for the step test, resolution and dead band, its .02 for T86; the names of
// the tests are those in the thesis's section 2.2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::analysis {

enum class ValveTest : std::uint8_t {
  step_change,
  stepped_ramp,
  step_study,
  static_scan,
  dynamic_scan,
  sine
};
inline constexpr std::array kValveTests{ValveTest::step_change,  ValveTest::stepped_ramp,
                                        ValveTest::step_study,   ValveTest::static_scan,
                                        ValveTest::dynamic_scan, ValveTest::sine};
const char* to_text(ValveTest test) noexcept;

struct ValveTestSettings {
  double low = 0.0;      // CO units, the test goes no lower
  double high = 100.0;   // CO units, and no higher
  double span = 100.0;   // CO units, the output's range
  double hold_s = 10.0;  // s at each point: some five time constants of the position
  double sample_time_s = 0.1;
};

struct Hold {
  double output = 0.0;  // CO units
  double seconds = 0.0;
};
std::vector<Hold> plan(ValveTest test, const ValveTestSettings& settings);

// One hold as it was recorded.
struct HeldPosition {
  double output = 0.0;           // CO units
  std::vector<double> position;  // CO units, one a sample
};

// Named figures: units in the names. Infinite: never reached.
using ValveFigures = std::map<std::string, double>;
ValveFigures figures(ValveTest test, const ValveTestSettings& settings,
                     std::span<const HeldPosition> holds, double moved);

}  // namespace loopwarden::analysis
