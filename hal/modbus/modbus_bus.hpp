// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "hal/modbus/modbus_link.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/read_link.hpp"

namespace loopwarden::hal::modbus {

// Hands out the links of a process. A serial line is one link, whoever uses it. On TCP every unit
// has a connection and a thread of its own, so that one that is dead holds up no other; but units of a
// gateway that allows few connections share these, each in turn given to the one with the fewest units.
class ModbusBus {
 public:
  explicit ModbusBus(EventSink sink = {}) : sink_(std::move(sink)) {}

  // The link for `unit`, shared with all who asked for the same device by whatever name; it ends
  // with the last of them. Its settings are those of the first: config/ refuses others for the same
  // device, and `loopwardend --safe` drives what it refuses, over one connection.
  std::shared_ptr<ModbusLink> link(const LinkSettings& settings, std::uint8_t unit);
  // The same link for one who only reads.
  ReadLink read_link(const LinkSettings& settings, std::uint8_t unit) {
    return ReadLink(link(settings, unit));
  }

 private:
  std::string key_of(const LinkSettings& settings, std::uint8_t unit);

  const EventSink sink_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<ModbusLink>> links_;
  std::map<std::string, std::vector<std::uint8_t>> gateway_units_;  // as they came
};

}  // namespace loopwarden::hal::modbus
