// SPDX-License-Identifier: Apache-2.0
// Whether the transactions that the loops ask for fit on a serial line.
//
// Each poll period of a loop reads PV (and its status register), writes the command and reads the
// valve position (and its status register), as far as they are on this line. Values of loops that other
// controllers run are counted as they are asked for: those of one unit, table and period together, as far as
// hal/modbus/read_runs.hpp joins them. Time of a transaction: hal/modbus/line_time.hpp.
#pragma once

#include <string>
#include <vector>

#include "config/loop_config.hpp"

namespace loopwarden::config {

inline constexpr double kMostBusLoad = 0.7;  // share of the time; the rest is for retries

// s of the line that one poll period of the loop takes; 0 if the loop does not use it.
double line_time_s(const hal::modbus::LoopModbusSettings& loop,
                   const hal::modbus::LinkSettings& line);

struct BusLoad {
  double share = 0.0;  // of the time that the line is busy
  std::string
      details;  // "FIC-101 42 ms of 100 ms, FIC-102 ..., watched loops 30 ms of 1000 ms (2 requests)"
};

BusLoad bus_load(const std::vector<LoopConfig>& loops, const hal::modbus::LinkSettings& line);

}  // namespace loopwarden::config
