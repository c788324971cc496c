// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_bus.hpp"

#include <stdexcept>

namespace loopwarden::hal::modbus {
namespace {

bool same_settings(LinkSettings a, const LinkSettings& b) {
  a.name = b.name;
  return a == b;
}

}  // namespace

std::shared_ptr<ModbusLink> ModbusBus::link(const LinkSettings& settings, std::uint8_t unit) {
  const std::string key = settings.transport == Transport::rtu
                              ? settings.device
                              : settings.host + " port " + std::to_string(settings.port) +
                                    " unit " + std::to_string(unit);
  const std::lock_guard lock(mutex_);
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
