// SPDX-License-Identifier: Apache-2.0
// All keys that a reload compares, with the effect of a change.
#pragma once

#include <cstdint>
#include <vector>

#include "config/loop_config.hpp"
#include "daemon/app/reload.hpp"

namespace loopwarden::daemon::reload {

// The effects that reload.hpp describes.
enum class Effect : std::uint8_t { applied, restart, meaning };

struct KeyChange {
  Change change;
  Effect effect = Effect::applied;
};

// Why a key with the effect `meaning` waits.
inline constexpr const char* kMeaning =
    "changes the meaning of the loop's numbers; needs a restart";

// Return the keys with different values, in the order of the files.
std::vector<KeyChange> compare(const config::LoopConfig& running, const config::LoopConfig& wanted);
std::vector<KeyChange> compare(const config::DaemonConfig& running,
                               const config::DaemonConfig& wanted);

}  // namespace loopwarden::daemon::reload
