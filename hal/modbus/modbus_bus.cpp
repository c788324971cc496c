// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_bus.hpp"

#include <algorithm>

#include "base/device_name.hpp"

namespace loopwarden::hal::modbus {

std::string ModbusBus::key_of(const LinkSettings& settings, std::uint8_t unit) {
  if (settings.transport == Transport::rtu) return base::device_name(settings.device);
  const std::string host =
      base::address_name(settings.host) + " port " + std::to_string(settings.port);
  if (!settings.connections) return host + " unit " + std::to_string(unit);
  std::vector<std::uint8_t>& units = gateway_units_[host];
  const auto known = std::find(units.begin(), units.end(), unit);
  const auto place = known - units.begin();
  if (known == units.end()) units.push_back(unit);
  return host + " connection " + std::to_string(place % *settings.connections + 1);
}

std::shared_ptr<ModbusLink> ModbusBus::link(const LinkSettings& settings, std::uint8_t unit) {
  const std::lock_guard lock(mutex_);
  const std::string key = key_of(settings, unit);
  if (auto open = links_[key].lock()) return open;
  auto link = std::make_shared<ModbusLink>(settings, sink_);
  links_[key] = link;
  return link;
}

}  // namespace loopwarden::hal::modbus
