// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm_figures.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "model/alarm/limits.hpp"

namespace loopwarden::alarm {
namespace {

using Times = std::map<std::pair<std::string, std::string>, std::vector<std::int64_t>>;

// Returns the largest number of alarms within a minute. `times` is in ascending order.
std::size_t densest(const std::vector<std::int64_t>& times) {
  std::size_t most = 0;
  std::size_t first = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    while (times[i] - times[first] > Limits::kChatter_ms) ++first;
    most = std::max(most, i - first + 1);
  }
  return most;
}

void most_first(std::vector<CountedAlarm>& alarms) {
  std::stable_sort(alarms.begin(), alarms.end(),
                   [](const CountedAlarm& a, const CountedAlarm& b) { return a.count > b.count; });
}

void count_stretches(const Times& all, std::int64_t from_ms, std::int64_t to_ms,
                     AlarmFigures& figures) {
  std::map<std::int64_t, std::size_t> stretches;
  for (const auto& [name, times] : all) {
    for (const std::int64_t ms : times) ++stretches[ms / Limits::kStretch_ms];
  }
  std::int64_t in_flood = 0;
  bool flood = false;
  for (std::int64_t at = from_ms / Limits::kStretch_ms; at <= (to_ms - 1) / Limits::kStretch_ms;
       ++at) {
    const auto found = stretches.find(at);
    const std::size_t count = found == stretches.end() ? 0 : found->second;
    figures.most_in_stretch = std::max(figures.most_in_stretch, count);
    if (!flood && count > Limits::kFloodBegins) ++figures.floods;
    flood = count > Limits::kFloodBegins || (flood && count >= Limits::kFloodEnds);
    // The first and the last interval may be only partly within the requested time.
    if (flood) {
      in_flood += std::min((at + 1) * Limits::kStretch_ms, to_ms) -
                  std::max(at * Limits::kStretch_ms, from_ms);
    }
  }
  figures.flood_percent =
      100.0 * static_cast<double>(in_flood) / static_cast<double>(to_ms - from_ms);
}

}  // namespace

AlarmFigures figures_of(std::span<const AlarmCame> came, std::int64_t from_ms, std::int64_t to_ms) {
  constexpr double kHour_ms = 3'600'000.0;
  AlarmFigures figures;
  if (to_ms <= from_ms) return figures;
  Times all;
  for (const AlarmCame& one : came) {
    if (one.utc_ms < from_ms || one.utc_ms >= to_ms) continue;
    all[{one.source, one.alarm}].push_back(one.utc_ms);
    ++figures.came;
  }
  figures.per_hour =
      static_cast<double>(figures.came) * kHour_ms / static_cast<double>(to_ms - from_ms);
  for (auto& [name, times] : all) {
    std::sort(times.begin(), times.end());
    const auto percent = [&](std::size_t count) {
      return 100.0 * static_cast<double>(count) / static_cast<double>(figures.came);
    };
    figures.top.push_back({name.first, name.second, times.size(), percent(times.size())});
    const std::size_t most = densest(times);
    if (most >= Limits::kChatters) {
      figures.chattering.push_back({name.first, name.second, most, percent(times.size())});
    }
  }
  most_first(figures.top);
  if (figures.top.size() > Limits::kTop) figures.top.resize(Limits::kTop);
  most_first(figures.chattering);
  count_stretches(all, from_ms, to_ms, figures);
  return figures;
}

}  // namespace loopwarden::alarm
