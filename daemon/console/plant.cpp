// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/plant.hpp"

#include <fmt/format.h>

#include <optional>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {

std::size_t loop_index(const Plant& plant, const std::string& name) {
  const std::optional<std::size_t> found = find_loop(plant.loops, name);
  if (!found) throw RequestError("no loop '" + name + "'");
  return *found;
}

void check_takes_commands(const Plant& plant, std::size_t loop) {
  const LoopRuntime& runtime = plant.loops[loop];
  if (const std::string* why = config::out_of_service(runtime.config.io)) {
    throw RequestError(fmt::format("{} is out of service: {}", plant.alarms.name(loop), *why));
  }
  if (!runtime.watched()) return;
  throw RequestError(plant.alarms.name(loop) +
                     " is controlled elsewhere: it cannot be commanded from here");
}

alarm::AlarmKind wanted_alarm(const std::string& name) {
  std::string all;
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    if (name == alarm::to_text(kind)) return kind;
    all += (all.empty() ? "" : ", ") + std::string(alarm::to_text(kind));
  }
  throw RequestError("no alarm '" + name + "'; alarms are " + all);
}

alarm::BoxAlarm wanted_box_alarm(const std::string& name) {
  std::string all;
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) {
    if (name == alarm::to_text(kind)) return kind;
    all += (all.empty() ? "" : ", ") + std::string(alarm::to_text(kind));
  }
  throw RequestError("the box has no alarm '" + name + "'; its alarms are " + all);
}

}  // namespace loopwarden::daemon::console
