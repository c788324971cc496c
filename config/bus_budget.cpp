// SPDX-License-Identifier: Apache-2.0
#include "config/bus_budget.hpp"

#include <fmt/format.h>

#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::config {
namespace {

using hal::modbus::LinkSettings;
using hal::modbus::PointSettings;

constexpr double kTurnaround = 0.005;  // s
constexpr int kBitsPerByte = 11;

double transaction_s(const LinkSettings& line, int bytes) {
  constexpr int kFixedSilenceAbove = 19200;  // baud
  constexpr double kFixedSilence = 0.00175;  // s
  const double byte_s = kBitsPerByte / static_cast<double>(line.baud);
  const double silence_s = line.baud > kFixedSilenceAbove ? kFixedSilence : 3.5 * byte_s;
  return bytes * byte_s + 2.0 * silence_s + kTurnaround + line.pause_ms / 1000.0;
}

double read_s(const LinkSettings& line, int registers) {
  constexpr int kRequest = 8;      // unit, function, address, count, CRC
  constexpr int kReplyAround = 5;  // unit, function, byte count, CRC
  return transaction_s(line, kRequest + kReplyAround + 2 * registers);
}

double write_s(const LinkSettings& line, const hal::modbus::RegisterSpec& reg) {
  constexpr int kReply = 8;
  constexpr int kSingleRequest = 8;
  constexpr int kMultipleAround = 9;  // unit, function, address, count, byte count, CRC
  const bool single = reg.write_function == hal::modbus::WriteFunction::single;
  return transaction_s(
      line, kReply + (single ? kSingleRequest : kMultipleAround + 2 * register_count(reg.type)));
}

double point_s(const LinkSettings& line, const PointSettings& point) {
  return read_s(line, register_count(point.reg.type)) + (point.status ? read_s(line, 1) : 0.0);
}

}  // namespace

double line_time_s(const hal::modbus::LoopModbusSettings& loop, const LinkSettings& line) {
  double time_s = 0.0;
  if (loop.transmitter_link.name == line.name) time_s += point_s(line, loop.process_variable);
  if (loop.positioner_link.name == line.name) {
    time_s += write_s(line, loop.command.reg);
    if (loop.read_back) time_s += point_s(line, *loop.read_back);
  }
  return time_s;
}

double line_time_s(const hal::modbus::ModbusSourceSettings& loop, const LinkSettings& line) {
  double time_s = 0.0;
  const auto add = [&](const hal::modbus::SourcePoint& read) {
    if (read.link.name == line.name) time_s += point_s(line, read.point);
  };
  add(loop.process_variable);
  add(loop.output);
  if (loop.set_point) add(*loop.set_point);
  if (loop.stem) add(*loop.stem);
  if (loop.mode) add(*loop.mode);
  return time_s;
}

BusLoad bus_load(const std::vector<LoopConfig>& loops, const LinkSettings& line) {
  BusLoad load;
  for (const LoopConfig& loop : loops) {
    double time_s = 0.0;
    double period_s = 1.0;
    const auto take = [&](const auto* modbus) {
      if (modbus == nullptr) return;
      time_s = line_time_s(*modbus, line);
      period_s = static_cast<double>(modbus->poll_period_ns) / 1e9;
    };
    take(std::get_if<hal::modbus::LoopModbusSettings>(&loop.io));
    take(std::get_if<hal::modbus::ModbusSourceSettings>(&loop.io));
    if (time_s <= 0.0) continue;
    load.share += time_s / period_s;
    load.details += fmt::format("{}{} {:.0f} ms of {:.0f} ms", load.details.empty() ? "" : ", ",
                                loop.name, time_s * 1e3, period_s * 1e3);
  }
  return load;
}

}  // namespace loopwarden::config
