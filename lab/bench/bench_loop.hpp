// SPDX-License-Identifier: Apache-2.0
// A loop as in the daemon, on the simulated plant, without the daemon's threads.
#pragma once

#include "daemon/rt/control_cycle.hpp"
#include "hal/sim/sim_loop_io.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::bench {

struct BenchLoop {
  BenchLoop(const plant::LoopModel& model, base::SpscRing<daemon::rt::Event>& events)
      : io({.model = model, .output_resolution = 10.0 / 4096.0, .io_faults = {}}),
        channels({.records = 64, .watched = 64}),
        cycle(0, model.sample_time_s, settings(model),
              {.mode = control::Mode::automatic, .set_point = 5.0, .output = {}},
              daemon::rt::ValvePositionSource::read_back, {}, io, channels, events) {}

  static daemon::rt::LoopSettings settings(const plant::LoopModel& model) {
    daemon::rt::LoopSettings s;
    s.controller = model.controller;
    s.pv_check.high = 10.0;
    return s;
  }

  hal::sim::SimLoopIo io;
  daemon::rt::LoopChannels channels;
  daemon::rt::ControlCycle cycle;
};

}  // namespace loopwarden::bench
