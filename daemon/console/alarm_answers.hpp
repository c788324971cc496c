// SPDX-License-Identifier: Apache-2.0
// Answers about the alarms as a whole: how they are meant, and how they did.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/console/parts.hpp"
#include "daemon/journal/journal_file.hpp"
#include "protocol/answers.hpp"

namespace loopwarden::daemon::console {

protocol::AlarmDesigns alarm_designs(const Parts& parts);
protocol::AlarmDesigns alarm_designs(const Parts& parts, std::size_t loop);

// `rows`: the journal's lines of alarms from `from_ms` on.
protocol::AlarmFigures figures_of(const Parts& parts, const std::vector<journal::JournalRow>& rows,
                                  std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::daemon::console
