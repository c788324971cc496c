// SPDX-License-Identifier: Apache-2.0
// Which reads of a unit one request serves. Modbus reads registers in a row, 125 at most (Modbus Application Protocol
// V1.1b3, 6.3 and 6.4), and a few that nobody asked for cost less than another request.
//
// Reads of one unit, table and period stand in a row by address. A run begins anew where more than kMostGap
// registers would be read for nobody, where a request would grow beyond what it may have, and where the device has
// refused to be asked for both sides at once. A read that the device refuses by itself has a run of its own.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

inline constexpr int kMostGap = 8;  // registers that nobody asked for, in a row

// Whether a value may be read together with others: registers without a status of their own.
inline bool can_be_merged(const PointSettings& point) noexcept {
  return !point.status && !is_bit(point.reg.table);
}

struct MergedRead {
  int address = 0;
  int end = 0;              // behind the last register
  bool apart = false;       // by itself alone
  bool cut_before = false;  // not with those below
};

// Where runs begin, as indices. `reads`: by address, then end.
inline std::vector<std::size_t> run_starts(std::span<const MergedRead> reads, int most_registers) {
  std::vector<std::size_t> starts;
  int low = 0;
  int high = 0;
  bool open = false;  // the run may go on
  for (std::size_t i = 0; i < reads.size(); ++i) {
    const MergedRead& read = reads[i];
    const bool joins = open && !read.apart && !read.cut_before && read.address - high <= kMostGap &&
                       std::max(high, read.end) - low <= most_registers;
    if (!joins) {
      starts.push_back(i);
      low = high = read.address;
    }
    high = std::max(high, read.end);
    open = !read.apart;
  }
  return starts;
}

}  // namespace loopwarden::hal::modbus
