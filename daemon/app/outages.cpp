// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/outages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <variant>

#include "config/interlocks.hpp"
#include "model/alarm/limits.hpp"

namespace loopwarden::daemon {
namespace {

using alarm::BoxAlarm;
using base::Reason;

}  // namespace

std::optional<Outages::Behind> Outages::behind(const LoopRuntime& loop, Reason silence) const {
  if (silence == Reason::none) return std::nullopt;
  if (const auto* io = std::get_if<hal::modbus::LoopModbusSettings>(&loop.config.io)) {
    return Behind{.what = config::connection_of(loop.config.io), .unit = io->process_variable.unit};
  }
  if (const auto* io = std::get_if<hal::modbus::ModbusSourceSettings>(&loop.config.io)) {
    return Behind{.what = config::connection_of(loop.config.io),
                  .unit = io->process_variable.point.unit};
  }
  const auto* io = std::get_if<hal::feed::FeedSettings>(&loop.config.io);
  if (io == nullptr) return std::nullopt;
  const hal::feed::FeedName& pv = io->process_variable.name;
  const auto found = feeders_.feeders().find(pv.feeder);
  if (found == feeders_.feeders().end()) return std::nullopt;
  const hal::feed::Feeder& feeder = *found->second;
  if (!feeder.counters().connected.load(std::memory_order_relaxed) || silence == Reason::stale) {
    return Behind{.what = pv.feeder, .feeder = true};
  }
  if (silence == Reason::never_received) return std::nullopt;
  const std::string source = feeder.source_of(pv.name);
  if (!source.empty()) return Behind{.what = fmt::format("{} ({})", source, pv.feeder)};
  return Behind{.what = fmt::format("source of {} ({})", pv.feeder, base::to_text(silence))};
}

std::string Outages::known_outage() const {
  for (const BoxAlarm kind : {BoxAlarm::connection_lost, BoxAlarm::feeder_lost}) {
    if (box_.alarms().alarm(kind).active()) return alarm::to_text(kind);
  }
  return {};
}

void Outages::restore() {
  const std::string known = known_outage();
  if (known.empty()) return;
  for (std::size_t i = 0; i < loops_.size(); ++i) alarms_.of(i).behind_outage(known);
}

host::LostConnections Outages::look(double uptime_s) {
  const bool starting = uptime_s < alarm::AlarmLimits::kFirstValues_s;
  struct Lost {
    host::LostConnection connection;
    std::set<int> units;
  };
  std::map<std::pair<bool, std::string>, Lost> lost;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    Reason silence = Reason::none;
    alarms_.look(i, [&](const supervision::AlarmSnapshot& watch) { silence = watch.pv_silence; });
    const std::optional<Behind> found = behind(loops_[i], silence);
    if (!found) {
      const bool awaited = starting && silence == Reason::never_received;
      alarms_.of(i).behind_outage(awaited ? known_outage() : std::string());
      continue;
    }
    Lost& its = lost[{found->feeder, found->what}];
    if (found->unit) its.units.insert(*found->unit);
    host::LostConnection& one = its.connection;
    one.what = found->what;
    one.loops.push_back(loops_[i].config.name);
    one.controlled = one.controlled || !loops_[i].watched();
    alarms_.of(i).behind_outage(
        alarm::to_text(found->feeder ? BoxAlarm::feeder_lost : BoxAlarm::connection_lost));
  }
  host::LostConnections all;
  for (auto& [key, one] : lost) {
    if (!one.units.empty())
      one.connection.what += fmt::format(", unit {}", fmt::join(one.units, ", "));
    (key.first ? all.feeders : all.connections).push_back(std::move(one.connection));
  }
  return all;
}

std::vector<protocol::ConnectionStatus> Outages::connections() const {
  std::map<std::string, protocol::ConnectionStatus> all;
  for (const auto& [name, feeder] : feeders_.feeders()) {
    all[name] = {.name = name,
                 .feeder = true,
                 .up = feeder->counters().connected.load(std::memory_order_relaxed)};
  }
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const std::string name = config::connection_of(loops_[i].config.io);
    if (name.empty()) continue;
    protocol::ConnectionStatus& one = all[name];
    one.name = name;
    ++one.loops;
    Reason silence = Reason::none;
    alarms_.look(i, [&](const supervision::AlarmSnapshot& watch) { silence = watch.pv_silence; });
    if (silence == Reason::none) continue;
    ++one.silent_loops;
    const std::optional<Behind> found = behind(loops_[i], silence);
    if (!found) continue;
    std::string lost = found->unit ? fmt::format("unit {}", *found->unit) : found->what;
    if (const auto end = lost.rfind(" (" + name + ")"); end != std::string::npos) lost.resize(end);
    if (found->feeder) lost = "sends no lines";
    if (std::find(one.lost.begin(), one.lost.end(), lost) == one.lost.end()) {
      one.lost.push_back(std::move(lost));
    }
  }
  std::vector<protocol::ConnectionStatus> list;
  for (auto& [name, one] : all) {
    // A link works if any loop on it receives PV.
    if (!one.feeder) one.up = one.silent_loops < one.loops;
    list.push_back(std::move(one));
  }
  return list;
}

}  // namespace loopwarden::daemon
