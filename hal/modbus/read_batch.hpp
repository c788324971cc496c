// SPDX-License-Identifier: Apache-2.0
// What one request reads for a link: a run of read_runs.hpp, as far as it is due.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/modbus/link_task.hpp"
#include "hal/modbus/read_runs.hpp"

namespace loopwarden::hal::modbus {

// Puts `first`, which is due, and those of `tasks` that one request can serve with it into `batch`, by address: single
// reads of watched loops, due by now or within a tenth of their period.
void gather(LinkTask& first, std::span<LinkTask* const> tasks, std::int64_t now_ns,
            int most_registers, std::vector<LinkTask*>& batch);

// What to ask for all of `batch`.
ReadShape joint_shape(std::span<LinkTask* const> batch) noexcept;

// Where to part a batch of two or more that the device refuses: at its widest gap, the nearest to the middle of these.
std::size_t parting(std::span<LinkTask* const> batch) noexcept;

}  // namespace loopwarden::hal::modbus
