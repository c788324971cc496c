// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/map_reader.hpp"
#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

struct ReadChannel {
  ChannelSettings settings;
  ChannelRule rule;
};

// Reads one entry of `channels`. Relative paths start from the folder of `file`.
ReadChannel read_channel(config::MapReader& in, const std::string& name, const std::string& file);

}  // namespace loopwarden::notify
