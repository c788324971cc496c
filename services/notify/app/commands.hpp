// SPDX-License-Identifier: Apache-2.0
// What loopwarden-notify does besides running: each prints its result and returns the exit code.
#pragma once

#include <cstddef>
#include <string>

#include "services/notify/config/notify_config.hpp"

namespace loopwarden::notify {

// Sends a test message through each channel, or the one named, all at once, and says what came of it. 74 if one did
// not take it, 64 if there is no channel of that name. Rules, queue and journal have no part in it.
int test_channels(const NotifyConfig& config, const std::string& only);

// The newest notifications of the state directory, newest first, with what came of them. 74 if there is no journal.
int list_notifications(const NotifyConfig& config, std::size_t most, bool json);

// Watches until SIGTERM or SIGINT, which must be blocked. 78 if a secret is missing, 74 if the store can't be
// opened.
int watch(NotifyConfig config);

}  // namespace loopwarden::notify
