// SPDX-License-Identifier: Apache-2.0
// Every key of the files that a reload compares, and what another value of it brings about.
#pragma once

#include <cstdint>
#include <vector>

#include "config/loop_config.hpp"
#include "daemon/app/reload.hpp"

namespace loopwarden::daemon::reload {

// As reload.hpp has them.
enum class Effect : std::uint8_t { applied, restart, meaning };

struct KeyChange {
  Change change;
  Effect effect = Effect::applied;
};

// Why a key waits that changes the meaning of others.
inline constexpr const char* kMeaning = "changes what the loop's numbers mean; needs a restart";

// Keys with another value, in the order of the files.
std::vector<KeyChange> compare(const config::LoopConfig& running, const config::LoopConfig& wanted);
std::vector<KeyChange> compare(const config::DaemonConfig& running,
                               const config::DaemonConfig& wanted);

}  // namespace loopwarden::daemon::reload
