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

// Provides the links of a process. A serial line is one link, shared by all its users. On TCP each
// unit has its own connection and thread, so that a dead unit delays no other. Units of a gateway
// that allows few connections share these. Each new unit is assigned to the connection with the
// fewest units.
class ModbusBus {
 public:
  explicit ModbusBus(EventSink sink = {}) : sink_(std::move(sink)) {}

  // Returns the link for `unit`. It is shared by all callers with the same device, under any name,
  // and ends with its last user. The first caller's settings apply. config/ refuses different
  // settings for the same device, except with `loopwardend --safe`, which uses one connection for
  // them.
  std::shared_ptr<ModbusLink> link(const LinkSettings& settings, std::uint8_t unit);
  // Returns the same link for read access only.
  ReadLink read_link(const LinkSettings& settings, std::uint8_t unit) {
    return ReadLink(link(settings, unit));
  }

 private:
  std::string key_of(const LinkSettings& settings, std::uint8_t unit);

  const EventSink sink_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<ModbusLink>> links_;
  std::map<std::string, std::vector<std::uint8_t>> gateway_units_;  // in order of arrival
};

}  // namespace loopwarden::hal::modbus
