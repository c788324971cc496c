// SPDX-License-Identifier: Apache-2.0
// Whether the transactions that the loops ask for fit on a serial line.
//
//   time of one transaction = bytes * 11 / baud + 2 * silence + turnaround + pause
//
//   bytes       request and reply, address and CRC included; 11 bits each on the line
//   silence     3.5 characters, at least 1.75 ms above 19200 baud, before each of the two frames
//   turnaround  until the device answers; 5 ms are assumed
//   pause       configured for the link, s
//
// Each poll period of a loop reads PV (and its status register), writes the command and reads the
// valve position (and its status register), as far as they are on this line; of a loop that another
// controller runs, each value that is wired.
//
// Source: Modbus over Serial Line V1.02, section 2.5.1 (frames and silent intervals).
#pragma once

#include <string>
#include <vector>

#include "config/loop_config.hpp"

namespace loopwarden::config {

inline constexpr double kMostBusLoad = 0.7;  // share of the time; the rest is for retries

// s of the line that one poll period of the loop takes; 0 if the loop does not use it.
double line_time_s(const hal::modbus::LoopModbusSettings& loop,
                   const hal::modbus::LinkSettings& line);
double line_time_s(const hal::modbus::ModbusSourceSettings& loop,
                   const hal::modbus::LinkSettings& line);

struct BusLoad {
  double share = 0.0;   // of the time that the line is busy
  std::string details;  // "FIC-101 42 ms of 100 ms, FIC-102 ..."
};

BusLoad bus_load(const std::vector<LoopConfig>& loops, const hal::modbus::LinkSettings& line);

}  // namespace loopwarden::config
