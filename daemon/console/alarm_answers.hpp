// SPDX-License-Identifier: Apache-2.0
// Design of the alarms, and figures of their performance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/console/plant.hpp"
#include "model/alarm/alarm_figures.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

protocol::AlarmDesigns alarm_designs(const Plant& plant);
protocol::AlarmDesigns alarm_designs(const Plant& plant, std::size_t loop);

protocol::AlarmFigures figures_of(const Plant& plant, std::span<const alarm::AlarmCame> came,
                                  std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::daemon::console
