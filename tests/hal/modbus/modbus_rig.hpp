// SPDX-License-Identifier: Apache-2.0
// Devices, proxies, settings and readers shared by the Modbus tests.
#pragma once

#include <time.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "hal/modbus/bus_waiter.hpp"
#include "hal/modbus/modbus_link.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "tests/support/device/foreign_process.hpp"

namespace loopwarden::test {

namespace mb = hal::modbus;

inline mb::LinkSettings tcp_link(const std::string& port) {
  mb::LinkSettings link;
  link.name = "tcp";
  link.host = "127.0.0.1";
  link.port = static_cast<std::uint16_t>(std::stoi(port));
  link.reconnect_min_s = 0.05;
  link.reconnect_max_s = 0.2;
  return link;
}

inline mb::LinkSettings rtu_link(const std::string& device) {
  mb::LinkSettings link;
  link.name = "line";
  link.transport = mb::Transport::rtu;
  link.device = device;
  link.baud = 115200;
  link.parity = mb::Parity::none;
  link.response_timeout_ms = 150;
  link.reconnect_min_s = 0.05;
  link.reconnect_max_s = 0.2;
  link.probe_interval_s = 0.5;
  return link;
}

inline mb::PointSettings input(std::uint16_t address, mb::RegisterType type,
                               mb::ByteOrder order = mb::ByteOrder::abcd, double scale = 1.0,
                               std::uint8_t unit = 1) {
  mb::PointSettings point;
  point.unit = unit;
  point.reg.table = mb::Table::input_register;
  point.reg.address = address;
  point.reg.type = type;
  point.reg.order = order;
  point.reg.scale = scale;
  return point;
}

// A pymodbus device on TCP behind a proxy.
struct TcpRig {
  explicit TcpRig(std::vector<std::string> arguments = {},
                  const std::string& program = "plant_device.py")
      : device(program, std::move(arguments)),
        proxy("fault_proxy.py", {"--to", "127.0.0.1:" + device.ready("port")}) {}
  mb::LinkSettings link() const { return tcp_link(proxy.ready("port")); }

  ForeignProcess device;
  ForeignProcess proxy;
};

// The same on a serial line of two pseudo-terminals.
struct SerialRig {
  explicit SerialRig(std::vector<std::string> arguments = {},
                     const std::string& program = "plant_device.py")
      : proxy("fault_proxy.py", {"--serial"}),
        device(program, with_line(std::move(arguments), proxy.ready("device"))) {}
  mb::LinkSettings link() const { return rtu_link(proxy.ready("master")); }

  static std::vector<std::string> with_line(std::vector<std::string> arguments,
                                            const std::string& path) {
    arguments.insert(arguments.end(), {"--serial", path});
    return arguments;
  }

  ForeignProcess proxy;
  ForeignProcess device;
};

// Collects events from bus threads.
class Events {
 public:
  mb::EventSink sink() {
    return [this](const mb::LinkEvent& event) {
      const std::lock_guard lock(mutex_);
      events_.push_back(event);
    };
  }
  int count(mb::LinkEvent::Kind kind) const {
    const std::lock_guard lock(mutex_);
    int found = 0;
    for (const mb::LinkEvent& event : events_) found += event.kind == kind ? 1 : 0;
    return found;
  }
  // Returns the text of the newest event; empty without one.
  std::string text(mb::LinkEvent::Kind kind) const {
    const std::lock_guard lock(mutex_);
    std::string text;
    for (const mb::LinkEvent& event : events_) {
      if (event.kind == kind) text = event.text;
    }
    return text;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<mb::LinkEvent> events_;
};

// A task attached to a link for the lifetime of this object, its points read from one thread.
class Reader {
 public:
  Reader(mb::ModbusLink& link, const std::vector<mb::PointSettings>& points,
         std::int64_t period_ns = 20'000'000)
      : link_(link) {
    task_.name = "reader";
    task_.period_ns = period_ns;
    for (const mb::PointSettings& point : points) {
      task_.reads.push_back(std::make_unique<mb::ReadPoint>(point));
    }
    link_.attach(task_);
  }
  ~Reader() { link_.detach(task_); }

  const hal::Sample& sample(std::size_t index = 0) { return task_.reads[index]->newest.newest(); }
  bool good(std::size_t index = 0) { return sample(index).quality == hal::Quality::good; }
  bool bad(std::size_t index = 0) { return sample(index).quality == hal::Quality::bad; }
  // Returns true if the newest sample is good and newer than those seen so far.
  bool fresh(std::size_t index = 0) {
    const hal::Sample& newest = sample(index);
    if (newest.quality != hal::Quality::good || newest.time_ns <= seen_ns_) return false;
    seen_ns_ = newest.time_ns;
    return true;
  }
  void forget() { seen_ns_ = mb::BusWaiter::now_ns(); }
  mb::TaskCounters& counters() { return task_.counters; }

 private:
  mb::ModbusLink& link_;
  mb::LinkTask task_;
  std::int64_t seen_ns_ = 0;
};

// A tag register of the device: its number, and the time when the device read it.
struct Tag {
  explicit Tag(double value)
      : register_number(static_cast<unsigned>(value) / 0x10000U - 0xA000U),
        clock_ms(static_cast<unsigned>(value) % 0x10000U) {}
  // Returns the time from the device's sample to the master's request, ms; negative if it was
  // sampled after.
  int age_ms(std::int64_t asked_ns) const {
    const auto asked = static_cast<unsigned>(asked_ns / 1'000'000) & 0xFFFFU;
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(asked - clock_ms));
  }
  unsigned register_number;
  unsigned clock_ms;
};

}  // namespace loopwarden::test
