// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_bus.hpp"

#include <algorithm>
#include <stdexcept>

namespace loopwarden::hal::modbus {
namespace {

bool same_settings(LinkSettings a, const LinkSettings& b) {
  a.name = b.name;
  return a == b;
}

}  // namespace

std::string ModbusBus::key_of(const LinkSettings& settings, std::uint8_t unit) {
  if (settings.transport == Transport::rtu) return settings.device;
  const std::string host = settings.host + " port " + std::to_string(settings.port);
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
  if (auto open = links_[key].lock()) {
    if (!same_settings(open->settings(), settings)) {
      throw std::runtime_error(key + " is in use by link '" + open->settings().name +
                               "' with other settings");
    }
    return open;
  }
  auto link = std::make_shared<ModbusLink>(settings, sink_);
  links_[key] = link;
  return link;
}

}  // namespace loopwarden::hal::modbus
