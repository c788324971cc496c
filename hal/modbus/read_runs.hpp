// SPDX-License-Identifier: Apache-2.0
// Groups the reads of a unit into requests. Modbus reads consecutive registers, at most 125 (Modbus
// Application Protocol V1.1b3, 6.3 and 6.4). A few unneeded registers cost less than another
// request.
//
// Reads of one unit, table and period are ordered by address. A new run begins:
// - if more than kMostGap unneeded registers would be read,
// - if a request would exceed its limit, or
// - if the device has refused to be asked for both sides at once.
//
// A read that the device refuses when read singly has a separate run.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

inline constexpr int kMostGap = 8;  // consecutive registers that no loop needs

// Returns whether a value may be read together with others. True for registers without a status
// register.
inline bool can_be_merged(const PointSettings& point) noexcept {
  return !point.status && !is_bit(point.reg.table);
}

struct MergedRead {
  int address = 0;
  int end = 0;              // one after the last register
  bool apart = false;       // must be read singly
  bool cut_before = false;  // not with those of lower addresses
};

// Returns the indices at which runs begin. `reads`: ordered by address, then end.
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
