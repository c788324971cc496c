// SPDX-License-Identifier: Apache-2.0
// Which reads of a unit one request serves. Modbus reads registers in a row, 125 at most (Modbus Application Protocol
// V1.1b3, 6.3 and 6.4), and a few that nobody asked for cost less than another request.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hal/modbus/link_task.hpp"

namespace loopwarden::hal::modbus {

inline constexpr int kMostGap = 8;  // registers that nobody asked for, in a row

// Puts `first`, which is due, and those of `tasks` that one request can serve with it into `batch`: single reads of
// watched loops, of the same unit and table, due by now or within a tenth of their period. Returns what to ask for.
ReadShape gather(LinkTask& first, std::span<LinkTask* const> tasks, std::int64_t now_ns,
                 std::vector<LinkTask*>& batch);

}  // namespace loopwarden::hal::modbus
