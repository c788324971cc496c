// SPDX-License-Identifier: Apache-2.0
// Tests of a valve with the loop in manual: the plan of CO, and the figures from the recorded
// positions.
//
//   step_change   one step up, one down: dead time, T63, T86, overshoot
//   stepped_ramp  ten steps of 1 % up, ten down: number of steps that the valve follows, and its
//                 largest lag after CO
//   step_study    for sizes of 0.1, 0.2, 0.5, 1, 2, 5 % of the range: a step in the direction of
//                 the last move, then one back. Resolution is the least size that moves the stem in
//                 that direction, dead band the least that moves it back; infinite if no size does
//   static_scan   21 points up and down, each held: hysteresis with dead band (greatest distance
//                 between the branches in % of the range), dead band (their median distance over
//                 CO), linearity
//   dynamic_scan  a slow ramp up and down, the signature of the valve: the same figures, and the
//                 distance along CO
//   sine          sines at 1/64 to 1/8 Hz about mid range: gain, and phase in degrees
//
// A plan is a list of outputs with the time to hold each. Every output is within [low, high] of the
// settings. Positions are in CO units: the read-back, or (PV - PV at the start)/gain + CO at the
// start. A stem has moved if the means of the last thirds of two successive holds differ by more
// than `moved`.
//
// Limits: without a read-back, the position includes the process. Lags are then those of the
// process, and the noise of PV determines `moved`.
//
// Sources: ISA-75.25.01 (2000) for the step test, resolution and dead band, its part .02 for T86;
// the names of the tests are those of section 2.2 of the thesis.
#pragma once

#include <array>
#include <cstdint>
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
  double low = 0.0;      // lowest output of the test, CO units
  double high = 100.0;   // CO units, greatest output of the test
  double span = 100.0;   // CO units, range of the output
  double hold_s = 10.0;  // s per point: about five time constants of the position
  double sample_time_s = 0.1;
};

struct Hold {
  double output = 0.0;  // CO units
  double seconds = 0.0;
};
// Returns the holds of a test.
std::vector<Hold> plan(ValveTest test, const ValveTestSettings& settings);

// The record of one hold.
struct HeldPosition {
  double output = 0.0;           // CO units
  std::vector<double> position;  // CO units, one per sample
};

// Figures by name; the names contain the units. Infinite: never reached.
using ValveFigures = std::map<std::string, double>;
// Returns the figures of a test from its recorded holds.
ValveFigures figures(ValveTest test, const ValveTestSettings& settings,
                     std::span<const HeldPosition> holds, double moved);

}  // namespace loopwarden::analysis
