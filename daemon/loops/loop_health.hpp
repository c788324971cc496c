// SPDX-License-Identifier: Apache-2.0
// Returns the NAMUR NE 107 state of a loop from its newest cycle and its alarms.
#pragma once

#include "daemon/supervision/alarm_registry.hpp"
#include "config/loop_config.hpp"
#include "record/record_row.hpp"
#include "model/alarm/ne107.hpp"

namespace loopwarden::daemon {

bool is_simulated(const config::LoopConfig& config) noexcept;

alarm::Ne107 health_of(const config::LoopConfig& config, const record::RecordRow& row,
                       const supervision::AlarmSnapshot& watch, double severe_percent) noexcept;

}  // namespace loopwarden::daemon
