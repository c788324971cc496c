// SPDX-License-Identifier: Apache-2.0
#include "config/bus_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "hal/modbus/line_time.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/read_runs.hpp"

namespace loopwarden::config {
namespace {

using hal::modbus::LinkSettings;
using hal::modbus::MergedRead;
using hal::modbus::PointSettings;

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

// Returns the points that watched loops read on the line, by poll period in ns.
std::map<std::int64_t, std::vector<PointSettings>> watched_points(
    const std::vector<LoopConfig>& loops, const LinkSettings& line) {
  std::map<std::int64_t, std::vector<PointSettings>> points;
  for (const LoopConfig& loop : loops) {
    const auto* modbus = std::get_if<hal::modbus::ModbusSourceSettings>(&loop.io);
    if (modbus == nullptr) continue;
    const auto add = [&](const hal::modbus::SourcePoint& read) {
      if (read.link.name == line.name) points[modbus->poll_period_ns].push_back(read.point);
    };
    add(modbus->process_variable);
    add(modbus->output);
    if (modbus->set_point) add(*modbus->set_point);
    if (modbus->stem) add(*modbus->stem);
    if (modbus->mode) add(*modbus->mode);
  }
  return points;
}

struct Requests {
  double time_s = 0.0;
  std::size_t number = 0;
};

Requests requests_of(const std::vector<PointSettings>& points, const LinkSettings& line,
                     int most_registers) {
  Requests requests;
  std::map<std::pair<std::uint8_t, hal::modbus::Table>, std::vector<MergedRead>> rows;
  for (const PointSettings& point : points) {
    if (!hal::modbus::can_be_merged(point)) {
      requests.time_s += point_s(line, point);
      requests.number += point.status ? 2U : 1U;
      continue;
    }
    rows[{point.unit, point.reg.table}].push_back(
        {.address = point.reg.address, .end = point.reg.address + register_count(point.reg.type)});
  }
  for (auto& [device, row] : rows) {
    std::sort(row.begin(), row.end(), [](const MergedRead& a, const MergedRead& b) {
      return std::pair(a.address, a.end) < std::pair(b.address, b.end);
    });
    auto starts = hal::modbus::run_starts(row, most_registers);
    requests.number += starts.size();
    starts.push_back(row.size());
    for (std::size_t i = 1; i < starts.size(); ++i) {
      int end = 0;
      for (std::size_t k = starts[i - 1]; k < starts[i]; ++k) end = std::max(end, row[k].end);
      requests.time_s += read_s(line, end - row[starts[i - 1]].address);
    }
  }
  return requests;
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

BusLoad bus_load(const std::vector<LoopConfig>& loops, const LinkSettings& line) {
  BusLoad load;
  const auto add = [&](const std::string& who, double time_s, double period_s,
                       const std::string& how) {
    load.share += time_s / period_s;
    load.details += fmt::format("{}{} {:.0f} ms of {:.0f} ms{}", load.details.empty() ? "" : ", ",
                                who, time_s * 1e3, period_s * 1e3, how);
  };
  double shortest_s = std::numeric_limits<double>::infinity();
  for (const LoopConfig& loop : loops) {
    const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io);
    const double time_s = modbus == nullptr ? 0.0 : line_time_s(*modbus, line);
    if (time_s <= 0.0) continue;
    const double period_s = static_cast<double>(modbus->poll_period_ns) / 1e9;
    shortest_s = std::min(shortest_s, period_s);
    add(loop.name, time_s, period_s, "");
  }
  const int most = hal::modbus::most_registers_together(line, shortest_s);
  for (const auto& [period_ns, points] : watched_points(loops, line)) {
    const Requests requests = requests_of(points, line, most);
    add("watched loops", requests.time_s, static_cast<double>(period_ns) / 1e9,
        fmt::format(" ({} request{})", requests.number, requests.number == 1 ? "" : "s"));
  }
  return load;
}

}  // namespace loopwarden::config
