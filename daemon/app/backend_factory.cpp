// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/backend_factory.hpp"

#include <spdlog/spdlog.h>

#include "hal/iio/analog_loop_io.hpp"
#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_loop_io.hpp"
#include "hal/replay/replay_loop_io.hpp"
#include "hal/sim/sim_loop_io.hpp"

namespace loopwarden::daemon {
namespace {

void log_link_event(const hal::modbus::LinkEvent& event) {
  using Kind = hal::modbus::LinkEvent::Kind;
  const bool good = event.kind == Kind::connected || event.kind == Kind::unit_back ||
                    event.kind == Kind::watchdog_set;
  spdlog::log(good ? spdlog::level::info : spdlog::level::warn, "link {}: {}", event.link,
              event.text);
}

void log_analog_event(const hal::iio::AnalogEvent& event) {
  spdlog::log(event.good ? spdlog::level::info : spdlog::level::warn, "{}", event.text);
}

}  // namespace

BackendFactory::BackendFactory() : bus_(std::make_unique<hal::modbus::ModbusBus>(log_link_event)) {}
BackendFactory::~BackendFactory() = default;

std::unique_ptr<hal::LoopIo> BackendFactory::make(const config::LoopConfig& loop) {
  struct Maker {
    const config::LoopConfig& loop;
    hal::modbus::ModbusBus& bus;

    std::unique_ptr<hal::LoopIo> operator()(const hal::sim::SimSettings& io) const {
      return std::make_unique<hal::sim::SimLoopIo>(io);
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::modbus::LoopModbusSettings& io) const {
      return std::make_unique<hal::modbus::ModbusLoopIo>(io, loop.name, bus);
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::iio::AnalogSettings& io) const {
      return std::make_unique<hal::iio::AnalogLoopIo>(io, loop.name, log_analog_event);
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::replay::ReplaySettings& io) const {
      return std::make_unique<hal::replay::ReplayLoopIo>(io);
    }
  };
  return std::visit(Maker{loop, *bus_}, loop.io);
}

}  // namespace loopwarden::daemon
