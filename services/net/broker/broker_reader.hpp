// SPDX-License-Identifier: Apache-2.0
// What edge.yaml and feed.yaml have in common: the section `broker`, names of Sparkplug.
#pragma once

#include <string>

#include "config/map_reader.hpp"
#include "services/net/mqtt/client.hpp"

namespace loopwarden::broker {

// `file`: where relative paths start. `client_id`: in words, what an empty one stands for; it stays empty here.
void read_broker(config::MapReader in, const std::string& file, const std::string& client_id,
                 mqtt::ClientSettings& mqtt);

// Reports a name that no topic can hold.
void check_identifier(config::MapReader& in, const char* key,
                      const config::Value<std::string>& name);

}  // namespace loopwarden::broker
