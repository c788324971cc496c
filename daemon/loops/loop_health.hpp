// SPDX-License-Identifier: Apache-2.0
// NAMUR NE 107 of one loop, from its newest cycle and its alarms.
#pragma once

#include "config/loop_config.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "record/record_row.hpp"
#include "model/monitor/ne107.hpp"

namespace loopwarden::daemon {

bool is_simulated(const config::LoopConfig& config) noexcept;

loopwarden::monitor::Ne107 health_of(const config::LoopConfig& config, const record::RecordRow& row,
                                     const supervision::AlarmSnapshot& watch,
                                     double severe_percent) noexcept;

}  // namespace loopwarden::daemon
