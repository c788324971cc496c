// SPDX-License-Identifier: Apache-2.0
// What the edge nodes of a Sparkplug group have, heard at the broker.
#pragma once

#include <chrono>
#include <string>

#include "services/feed/feed_config.hpp"

namespace loopwarden::feed {

// Listens to the group for so long, asks for births where `config` says so, and prints the list (values/birth_list.hpp) to
// the standard output. Returns an exit code: 74 where the broker is not reached or no birth was heard.
int browse(FeedConfig config, const std::string& group, std::chrono::seconds patience);

}  // namespace loopwarden::feed
