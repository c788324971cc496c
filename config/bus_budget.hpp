// SPDX-License-Identifier: Apache-2.0
// Checks whether the transactions of all loops fit on a serial line.
//
// In each poll period a loop reads PV and the valve position, each with its status register, and
// writes the command. Only transactions on this line count. Values of loops that other controllers
// run are counted by requests. Values of one unit, table and period share a request as far as
// hal/modbus/read_runs.hpp joins them. Time of a transaction: hal/modbus/line_time.hpp.
#pragma once

#include <string>
#include <vector>

#include "config/loop_config.hpp"

namespace loopwarden::config {

inline constexpr double kMostBusLoad = 0.7;  // share of the time; the remaining time is for retries

// Returns the time of the line that one poll period of the loop takes, s; 0 if the loop does not
// use the line.
double line_time_s(const hal::modbus::LoopModbusSettings& loop,
                   const hal::modbus::LinkSettings& line);

struct BusLoad {
  double share = 0.0;  // share of the time in which the line is busy
  std::string
      details;  // "FIC-101 42 ms of 100 ms, ..., watched loops 30 ms of 1000 ms (2 requests)"
};

BusLoad bus_load(const std::vector<LoopConfig>& loops, const hal::modbus::LinkSettings& line);

}  // namespace loopwarden::config
