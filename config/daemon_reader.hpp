// SPDX-License-Identifier: Apache-2.0
// Reads loopwardend.yaml: the settings of the daemon as a whole.
#pragma once

#include <map>
#include <string>

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

struct LinkState {
  Place place;
  bool sound = false;      // its section has no error
  bool addressed = false;  // the keys that locate the device have no error, so an output can be
                           // driven
};

struct DaemonFile {
  DaemonConfig config;
  Value<double> accelerate;
  // Links by name, including those with errors, so that a loop that refers to one has no error
  // itself.
  std::map<std::string, LinkState> links;
  std::size_t link_errors = 0;  // number of the file's errors in sections of links
};

DaemonFile read_daemon(MapReader& in, const std::string& file);

}  // namespace loopwarden::config
