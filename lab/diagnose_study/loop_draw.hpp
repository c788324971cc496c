// SPDX-License-Identifier: Apache-2.0
// Draws a process and a fitting controller: with margins, or at the stability limit.
#pragma once

#include "model/numeric/random.hpp"

namespace loopwarden::lab {

// Times in units of the logging interval.
struct ProcessDraw {
  bool integrating = false;
  double gain = 1.0;  // PV % per CO %, per time unit if integrating
  double tau1 = 1.0;
  double tau2 = 0.0;
  double dead_time = 0.0;
  double filter = 0.0;  // transmitter and controller together
};

struct ControllerDraw {
  double gain = 1.0;
  double integral_time = 1.0;
  double derivative_time = 0.0;
};

struct Draw {
  ProcessDraw process;
  ControllerDraw controller;
};

// dominant part of the controller
enum class Weight { balanced, integral, proportional, averaging };

struct LoopWish {
  bool integrating = false;
  bool tight = false;  // largest sensitivity 8 to 60 instead of 1.15 to 2.5
  Weight weight = Weight::balanced;
  double time_scale = 1.0;
  double interval = 1.0;  // of the controller
  double filter = 0.0;
  double closed_loop =
      0.0;  // closed-loop time of a rule-of-thumb PI, if slower than required by the process
};
Draw draw_loop(numeric::Random& random, const LoopWish& wish);

}  // namespace loopwarden::lab
