// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/alarm_book.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>

#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string();
}

using Counted = protocol::AlarmFigures::Counted;

std::string counted(const char* heading, const std::vector<Counted>& alarms) {
  if (alarms.empty()) return {};
  std::string text = fmt::format("\n{}\n", heading);
  for (const Counted& one : alarms) {
    text += fmt::format("  {:<14} {:<16} {:>6}  {:5.1f} % of all\n", one.loop, one.alarm, one.count,
                        one.percent);
  }
  return text;
}

}  // namespace

std::string utc_text(std::int64_t utc_ms) {
  if (utc_ms <= 0) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(static_cast<std::time_t>(utc_ms / 1000)));
}

std::string rationalised_csv(const protocol::AlarmDesigns& designs) {
  std::string text =
      "loop,alarm,priority,limit,dead_band,unit,on_delay_s,off_delay_s,suppressed_by,cause,"
      "consequence,action,time_to_act\n";
  for (const protocol::AlarmDesign& one : designs.alarms) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_cell(one.loop), one.alarm,
                        one.priority, number(one.limit), number(one.dead_band), csv_cell(one.unit),
                        number(one.on_delay_s), number(one.off_delay_s),
                        fmt::join(one.suppressed_by, " "), csv_cell(one.cause),
                        csv_cell(one.consequence), csv_cell(one.action), csv_cell(one.time_to_act));
  }
  return text;
}

std::string figures_text(const protocol::AlarmFigures& figures) {
  std::string text =
      fmt::format("{} to {} UTC\n\n", utc_text(figures.from_ms), utc_text(figures.to_ms));
  const auto line = [&](const char* what, const std::string& value, const char* target) {
    text += fmt::format("{:<26} {:>9}   {}\n", what, value, target);
  };
  line("alarms", fmt::format("{}", figures.came), "");
  line("an hour", fmt::format("{:.1f}", figures.per_hour), "target: at most 6");
  line("most in 10 min", fmt::format("{}", figures.most_in_10_min), "target: at most 10");
  line("floods", fmt::format("{}", figures.floods), "");
  line("in a flood", fmt::format("{:.1f} %", figures.flood_percent),
       "target: below 1 % of the time");
  line("chattering", fmt::format("{}", figures.chattering.size()), "target: none");
  line("on for more than a day", fmt::format("{}", figures.stale.size()), "target: fewer than 5");
  for (const auto& [priority, count] : figures.priorities) {
    line(("priority " + priority).c_str(), fmt::format("{}", count), "");
  }
  text += counted("most frequent (target: below 5 % of all)", figures.top);
  text += counted("chattering: most within a minute", figures.chattering);
  if (!figures.stale.empty()) text += "\non for more than a day\n";
  for (const protocol::AlarmFigures::Stale& one : figures.stale) {
    text +=
        fmt::format("  {:<14} {:<16} since {} UTC\n", one.loop, one.alarm, utc_text(one.since_ms));
  }
  return text;
}

}  // namespace loopwarden::workbench
