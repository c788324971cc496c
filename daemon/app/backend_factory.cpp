// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/backend_factory.hpp"

#include <stdexcept>
#include <string>
#include <variant>

#include "hal/contract/out_of_service.hpp"
#include "hal/feed/feed_table.hpp"
#include "hal/iio/analog_loop_io.hpp"
#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_loop_io.hpp"
#include "hal/modbus/modbus_source.hpp"
#include "hal/replay/replay_loop_io.hpp"
#include "hal/sim/sim_loop_io.hpp"

namespace loopwarden::daemon {
namespace {

void log_link_event(base::LimitedLog& log, const hal::modbus::LinkEvent& event) {
  using Kind = hal::modbus::LinkEvent::Kind;
  const bool good = event.kind == Kind::connected || event.kind == Kind::unit_back ||
                    event.kind == Kind::watchdog_set || event.kind == Kind::closes_connections;
  // A remark can be true in every state of the link, so it is logged as a separate subject.
  const bool remark = event.kind == Kind::closes_connections || event.kind == Kind::echo ||
                      event.kind == Kind::stray_bytes;
  const std::string kind = std::to_string(static_cast<int>(event.kind));
  const std::string subject = "link " + event.link + ' ' + (remark ? kind : event.subject);
  const std::string text = "link " + event.link + ": " + event.text;
  good ? log.info(subject, kind, text) : log.warn(subject, kind, text);
}

void log_analog_event(base::LimitedLog& log, const hal::iio::AnalogEvent& event) {
  const std::string subject = event.text.substr(0, event.text.find(": "));
  event.good ? log.info(subject, "good", event.text) : log.warn(subject, "bad", event.text);
}

}  // namespace

BackendFactory::BackendFactory()
    : bus_(std::make_unique<hal::modbus::ModbusBus>(
          [this](const hal::modbus::LinkEvent& event) { log_link_event(log_, event); })) {}
BackendFactory::~BackendFactory() = default;

std::unique_ptr<hal::LoopIo> BackendFactory::make(const config::LoopConfig& loop) {
  struct Maker {
    const config::LoopConfig& loop;
    hal::modbus::ModbusBus& bus;
    base::LimitedLog& log;

    std::unique_ptr<hal::LoopIo> operator()(const hal::sim::SimSettings& io) const {
      return std::make_unique<hal::sim::SimLoopIo>(io);
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::modbus::LoopModbusSettings& io) const {
      return std::make_unique<hal::modbus::ModbusLoopIo>(io, loop.name, bus);
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::iio::AnalogSettings& io) const {
      return std::make_unique<hal::iio::AnalogLoopIo>(
          io, loop.name,
          [&log = log](const hal::iio::AnalogEvent& event) { log_analog_event(log, event); });
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::replay::ReplaySettings& io) const {
      return std::make_unique<hal::replay::ReplayLoopIo>(io);
    }
    std::unique_ptr<hal::LoopIo> operator()(const config::OutOfService&) const {
      return std::make_unique<hal::OutOfServiceIo>();
    }
    // Sources have no output.
    std::unique_ptr<hal::LoopIo> operator()(const hal::modbus::ModbusSourceSettings&) const {
      throw std::logic_error(loop.name + " is controlled elsewhere");
    }
    std::unique_ptr<hal::LoopIo> operator()(const hal::feed::FeedSettings&) const {
      throw std::logic_error(loop.name + " is controlled elsewhere");
    }
  };
  return std::visit(Maker{loop, *bus_, log_}, loop.io);
}

std::unique_ptr<hal::LoopSource> BackendFactory::make_source(const config::LoopConfig& loop,
                                                             hal::feed::FeedTable& board) {
  if (config::out_of_service(loop.io) != nullptr) {
    return std::make_unique<hal::OutOfServiceSource>();
  }
  if (const auto* feed = std::get_if<hal::feed::FeedSettings>(&loop.io)) {
    return std::make_unique<hal::feed::FeedSource>(*feed, board);
  }
  return std::make_unique<hal::modbus::ModbusSource>(
      std::get<hal::modbus::ModbusSourceSettings>(loop.io), loop.name, *bus_);
}

}  // namespace loopwarden::daemon
