// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/host/host_alarms.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "daemon/recorder/historian.hpp"

namespace loopwarden::daemon::console {

// The loops with their newest cycles and their alarms. Any thread may read; only the thread of
// control.sock sends operator commands to the loops. The loops may be added after the sockets are
// created, but before they are served. All references outlive the servers.
struct Plant {
  std::vector<LoopRuntime>& loops;
  Historian& historian;
  supervision::AlarmRegistry& alarms;
  host::HostAlarms& box_alarms;
  double severe_percent;  // % of the CO span
};

// Return the index or the alarm of this name. Throw RequestError for an unknown name.
std::size_t loop_index(const Plant& plant, const std::string& name);
alarm::AlarmKind wanted_alarm(const std::string& name);
alarm::BoxAlarm wanted_box_alarm(const std::string& name);

// Throws RequestError if the loop accepts no commands here: out of service, or controlled
// elsewhere.
void check_takes_commands(const Plant& plant, std::size_t loop);

}  // namespace loopwarden::daemon::console
