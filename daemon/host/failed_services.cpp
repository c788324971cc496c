// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/failed_services.hpp"

#include <fmt/format.h>
#include <systemd/sd-bus.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

namespace loopwarden::daemon::host {
namespace {

constexpr std::uint64_t kPatience_us = 2'000'000;

using Bus = std::unique_ptr<sd_bus, decltype(&sd_bus_flush_close_unref)>;
using BusMessage = std::unique_ptr<sd_bus_message, decltype(&sd_bus_message_unref)>;

BusMessage question(sd_bus* bus) {
  sd_bus_message* made = nullptr;
  if (sd_bus_message_new_method_call(
          bus, &made, "org.freedesktop.systemd1", "/org/freedesktop/systemd1",
          "org.freedesktop.systemd1.Manager", "ListUnitsByPatterns") < 0) {
    return {nullptr, sd_bus_message_unref};
  }
  BusMessage message(made, sd_bus_message_unref);
  const bool filled = sd_bus_message_append(made, "asas", 2, "failed", "auto-restart", 1,
                                            "loopwarden-*.service") >= 0;
  return filled ? std::move(message) : BusMessage(nullptr, sd_bus_message_unref);
}

}  // namespace

std::optional<std::vector<std::string>> failed_services() {
  sd_bus* opened = nullptr;
  if (sd_bus_open_system(&opened) < 0) return std::nullopt;
  const Bus bus(opened, sd_bus_flush_close_unref);
  const BusMessage call = question(opened);
  sd_bus_message* answered = nullptr;
  if (call == nullptr || sd_bus_call(opened, call.get(), kPatience_us, nullptr, &answered) < 0) {
    return std::nullopt;
  }
  const BusMessage answer(answered, sd_bus_message_unref);
  if (sd_bus_message_enter_container(answered, SD_BUS_TYPE_ARRAY, "(ssssssouso)") < 0) {
    return std::nullopt;
  }
  std::vector<std::string> units;
  // The first field is the unit's name; the others are ignored.
  while (sd_bus_message_enter_container(answered, SD_BUS_TYPE_STRUCT, "ssssssouso") > 0) {
    const char* name = nullptr;
    if (sd_bus_message_read(answered, "s", &name) < 0 ||
        sd_bus_message_skip(answered, "sssssouso") < 0 ||
        sd_bus_message_exit_container(answered) < 0) {
      return std::nullopt;
    }
    units.emplace_back(name);
  }
  return units;
}

bool services_are_configured() {
  if (sd_booted() <= 0) return false;
  // The start condition of each unit: /etc/loopwarden-NAME/NAME.yaml.
  constexpr std::array kNames{"page", "notify", "edge", "feed", "opcua", "fleet"};
  return std::any_of(kNames.begin(), kNames.end(), [](const char* name) {
    std::error_code error;
    return std::filesystem::exists(fmt::format("/etc/loopwarden-{0}/{0}.yaml", name), error);
  });
}

}  // namespace loopwarden::daemon::host
