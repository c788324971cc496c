// SPDX-License-Identifier: Apache-2.0
// Returns the daemon's newest cycles as rows, if the loop is not recorded or the disk is late.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "services/page/history/block.hpp"

namespace loopwarden::page::history {

// A cycle whose clock is known, from which all others follow.
struct LastCycle {
  double period = 0.0;
  std::int64_t utc_ms = 0;
  double ms_per_period = 0.0;
};

// Returns the rows after `newest`, each as a block, in the order of time.
std::vector<Block> rows_of(const protocol::Trend& trend, const LastCycle& last,
                           const std::optional<Block>& newest);

}  // namespace loopwarden::page::history
