// SPDX-License-Identifier: Apache-2.0
// Answers about the alarms as a whole: how they are meant, and how they did.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/console/parts.hpp"
#include "model/alarm/alarm_figures.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

protocol::AlarmDesigns alarm_designs(const Parts& parts);
protocol::AlarmDesigns alarm_designs(const Parts& parts, std::size_t loop);

protocol::AlarmFigures figures_of(const Parts& parts, std::span<const alarm::AlarmCame> came,
                                  std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::daemon::console
