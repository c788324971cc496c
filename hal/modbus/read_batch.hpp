// SPDX-License-Identifier: Apache-2.0
// Selects the reads that one request serves: a run of read_runs.hpp, as far as its reads are due.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/modbus/link_task.hpp"
#include "hal/modbus/read_runs.hpp"

namespace loopwarden::hal::modbus {

// Puts `first`, which is due, and the tasks that the same request can serve into `batch`, by
// address. These are single reads of watched loops that are due now or within a tenth of their
// period.
void gather(LinkTask& first, std::span<LinkTask* const> tasks, std::int64_t now_ns,
            int most_registers, std::vector<LinkTask*>& batch);

// Returns the request for all of `batch`.
ReadShape joint_shape(std::span<LinkTask* const> batch) noexcept;

// Returns where to split a batch of two or more that the device refuses: at its widest gap. Of
// equal gaps, it takes the one nearest to the middle.
std::size_t parting(std::span<LinkTask* const> batch) noexcept;

}  // namespace loopwarden::hal::modbus
