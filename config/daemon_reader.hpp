// SPDX-License-Identifier: Apache-2.0
// loopwardend.yaml: what concerns the daemon as a whole.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

struct LinkState {
  Place place;
  bool sound = false;      // its section has no error
  bool addressed = false;  // nor has what leads to the device, so that an output can be driven
};

struct DaemonFile {
  DaemonConfig config;
  Value<double> accelerate;
  // Links by name, also those with errors, so that a loop that names one is not in error itself.
  std::map<std::string, LinkState> links;
  std::size_t link_errors = 0;  // of the file's errors those in sections of links
};

DaemonFile read_daemon(MapReader& in, const std::string& file);

}  // namespace loopwarden::config
