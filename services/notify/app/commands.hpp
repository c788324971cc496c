// SPDX-License-Identifier: Apache-2.0
// The commands of loopwarden-notify. Each prints its result and returns the exit code.
#pragma once

#include <cstddef>
#include <string>

#include "services/notify/config/notify_config.hpp"

namespace loopwarden::notify {

// Sends a test message through all channels at once, or through the one named, and prints the
// results. Rules, queue and journal are not used. Returns 74 if a channel did not take it, 64 if no
// channel has that name.
int test_channels(const NotifyConfig& config, const std::string& only);

// Prints the newest notifications of the state directory with their results, newest first. Returns
// 74 if there is no journal.
int list_notifications(const NotifyConfig& config, std::size_t most, bool json);

// Watches until SIGTERM or SIGINT, which must be blocked. Returns 78 if a secret is missing, 74 if
// the store can't be opened.
int watch(NotifyConfig config);

}  // namespace loopwarden::notify
