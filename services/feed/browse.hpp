// SPDX-License-Identifier: Apache-2.0
// Lists the metrics of the edge nodes of a Sparkplug group, as received from the broker.
#pragma once

#include <chrono>
#include <string>

#include "services/feed/feed_config.hpp"

namespace loopwarden::feed {

// Listens to the group for `patience`, requests births if `config` permits, and prints the list
// (values/birth_list.hpp) to the standard output. Returns an exit code: 74 if the broker is not
// reached or no birth was received.
int browse(FeedConfig config, const std::string& group, std::chrono::seconds patience);

}  // namespace loopwarden::feed
