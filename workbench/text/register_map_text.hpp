// SPDX-License-Identifier: Apache-2.0
// Writes the register map as documents and as configuration for the masters that read it. All are
// generated from the one table in daemon/registers, so they are always consistent.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::workbench {

struct MapOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 1502;
  std::uint8_t unit = 1;
  hal::modbus::ByteOrder word_order = hal::modbus::ByteOrder::abcd;
  std::vector<std::string> loops{"LOOP"};  // tags, in the order of their files
};

std::string map_markdown();                         // docs/reference/modbus-map.md
std::string map_csv(const MapOptions& options);     // every address with its loop
std::string map_mbpoll(const MapOptions& options);  // a bash script
std::string map_pymodbus(const MapOptions& options);
std::string map_javascript(const MapOptions& options);  // for modbus-serial of npm
std::string map_telegraf(const MapOptions& options);
std::string map_node_red(const MapOptions& options);  // a flow to import
nlohmann::json map_json(const MapOptions& options);

}  // namespace loopwarden::workbench
