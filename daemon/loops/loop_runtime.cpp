// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_runtime.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::daemon {

void CurrentSettings::gains_ordered(GainsAuthor author) {
  const std::lock_guard lock(mutex_);
  author_ = std::move(author);
}

void CurrentSettings::gains_of_file(const control::PidGains& gains) {
  const std::lock_guard lock(mutex_);
  file_ = gains;
  // A newer command may have arrived before these settings.
  if (not_in_file() == std::nullopt) author_ = {};
}

std::optional<CurrentSettings::GainsNotInFile> CurrentSettings::gains_not_in_file() const {
  const std::lock_guard lock(mutex_);
  return not_in_file();
}

std::optional<CurrentSettings::GainsNotInFile> CurrentSettings::not_in_file() const {
  channels_.in_force.fetch(settings_);
  const control::PidGains& now = settings_.controller.pid.gains;
  if (now.kp == file_.kp && now.ki == file_.ki && now.kd == file_.kd) return std::nullopt;
  return GainsNotInFile{.file = file_, .author = author_};
}

std::optional<std::size_t> find_loop(const std::vector<LoopRuntime>& loops,
                                     const std::string& name) {
  const auto found = std::find_if(loops.begin(), loops.end(), [&](const LoopRuntime& loop) {
    return loop.config.name == name;
  });
  if (found == loops.end()) return std::nullopt;
  return static_cast<std::size_t>(found - loops.begin());
}

rt::LoopSettings settings_of(const config::LoopConfig& config, config::Backing backing) {
  return {.controller = config.controller,
          .safety = config.safety,
          .pv_check = config.pv,
          .jacket_may_act = config::interlocks_of(config.controller.jacket, backing).none(),
          .moves_may_act = config::moves_may_act(config.monitor.corrective, backing)};
}

}  // namespace loopwarden::daemon
