// SPDX-License-Identifier: Apache-2.0
// The daemon's newest cycles as rows: where nothing is recorded, or the disk is behind.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "services/page/history/block.hpp"

namespace loopwarden::page::history {

// A cycle of which the clock is known, and by it of all others.
struct LastCycle {
  double period = 0.0;
  std::int64_t utc_ms = 0;
  double ms_per_period = 0.0;
};

// Those behind `newest`, each a block, in the order of time.
std::vector<Block> rows_of(const protocol::Trend& trend, const LastCycle& last,
                           const std::optional<Block>& newest);

}  // namespace loopwarden::page::history
