// SPDX-License-Identifier: Apache-2.0
// Reads the parts that edge.yaml and feed.yaml share: the section `broker`, and names of Sparkplug.
#pragma once

#include <string>

#include "config/map_reader.hpp"
#include "services/net/mqtt/client.hpp"

namespace loopwarden::broker {

// `file`: start of relative paths. `client_id`: describes the default of an empty client
// identifier.
void read_broker(config::MapReader in, const std::string& file, const std::string& client_id,
                 mqtt::ClientSettings& mqtt);

// Reports a name that a topic can't contain.
void check_identifier(config::MapReader& in, const char* key,
                      const config::Value<std::string>& name);

}  // namespace loopwarden::broker
