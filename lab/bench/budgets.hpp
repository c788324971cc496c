// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::bench {

// Design budget of a benchmark. The printed figure is scale * seconds per iteration, or items per
// second if `per_second` is set.
struct Budget {
  const char* benchmark;
  const char* what;
  const char* unit;
  double limit;
  bool at_least;    // true: the limit is a minimum; false: a maximum
  bool per_second;  // items per second instead of time
  double scale;
};

inline constexpr Budget kBudgets[]{
    {"control_cycle/healthy", "one loop's cycle, simulated backend, healthy valve", "ns", 1000.0,
     false, false, 1e9},
    {"control_cycle/sticking", "the same with stiction and the jacket", "ns", 1000.0, false, false,
     1e9},
    // Period 0.1 s: share of a core = seconds per round / 0.1 s.
    {"all_loops/1000_at_10Hz", "1000 loops at 10 Hz", "% of a core", 10.0, false, false, 1e3},
    // Period 0.01 s.
    {"all_loops/100_at_100Hz", "100 loops at 100 Hz", "% of a core", 10.0, false, false, 1e4},
    {"simulate/full_loop", "simulation of a full loop, stiction and noise", "million samples/s",
     20.0, true, true, 1e-6},
    {"specialist/eight", "a window through eight specialists of the thesis", "us", 50.0, false,
     false, 1e6},
    {"specialist/explaining", "a window through the explaining team", "us", 500.0, false, false,
     1e6},
    {"diagnose/sticking", "a window of 1000 samples through diagnose, sticking valve", "ms", 10.0,
     false, false, 1e3},
    {"diagnose/healthy", "the same, healthy valve", "ms", 10.0, false, false, 1e3},
    // Mean over 64 successive levels of 750 s, including those of longer samples: share of a core =
    // seconds / 750 s.
    {"diagnose/routine", "routine evidence of 1000 loops, all valves sticking", "% of a core", 5.0,
     false, false, 1e5 / 750.0},
    // Mean over 3000 cycles of 1 s: share of a core = seconds / 3000 s.
    {"monitor/commissioned", "1000 commissioned loops at 1 s: twin, controller, load, routine",
     "% of a core", 5.0, false, false, 1e5 / 3000.0},
    {"gap/whole", "gap workflow, 4200 samples, two threads", "s", 10.0, false, false, 1.0},
};

}  // namespace loopwarden::bench
