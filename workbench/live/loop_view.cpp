// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/loop_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "config/diagnostic.hpp"

namespace loopwarden::workbench {
namespace {

void append_tail(std::vector<double>& to, const std::vector<double>& from, std::size_t most) {
  to.insert(to.end(), from.begin(), from.end());
  if (to.size() > most) to.erase(to.begin(), to.end() - static_cast<std::ptrdiff_t>(most));
}

Colour mode_colour(const std::string& mode) {
  if (mode == "AUTO") return Colour::plain;
  return mode == "MAN" ? Colour::yellow : Colour::red;
}

std::string duration(double seconds) {
  const auto s = static_cast<long>(seconds);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

std::string record_and_bus_line(const nlohmann::json& loop) {
  const auto& io = loop.at("io");
  const auto& recording = loop.at("recording");
  const auto age = [&](const char* key) {
    const auto found = loop.find(key);
    return found != loop.end() && found->is_number() ? fmt::format("{:.1f}", found->get<double>())
                                                     : std::string("-");
  };
  return fmt::format(
      "{}: {}   PV age {} ms   position age {} ms   recorded {} rows, {} lost, {:.1f} MB   bus: {} "
      "transactions, {} "
      "timeouts, "
      "{} exceptions, {} invalid, {} reconnects",
      loop.value("name", ""), loop.value("description", ""), age("pv_age_ms"),
      age("position_age_ms"), recording.at("rows").get<std::uint64_t>(),
      recording.at("dropped").get<std::uint64_t>() +
          recording.value("queue_dropped", std::uint64_t{0}) +
          recording.at("rows_lost").get<std::uint64_t>(),
      recording.at("bytes").get<double>() / 1e6, io.at("transactions").get<std::uint64_t>(),
      io.at("timeouts").get<std::uint64_t>(), io.at("device_exceptions").get<std::uint64_t>(),
      io.at("invalid_replies").get<std::uint64_t>(), io.at("reconnects").get<std::uint64_t>());
}

// What the monitor says of the loop's valve.
std::string valve_line(const nlohmann::json& loop) {
  const auto& m = loop.at("monitor");
  const double index = m.value("oscillation_index", 0.0);
  return fmt::format(
      "valve: {}   window {}: {}   variability {:.2f} %   {}   travel {:.0f} %/h   {:.0f} "
      "reversals/h   stick {}",
      loop.value("ne107", "-"), m.at("windows").get<std::uint64_t>(), m.value("window_state", ""),
      m.value("variability_percent", 0.0),
      index > 1.0 ? fmt::format("oscillates at {:.1f} s", m.value("oscillation_period_s", 0.0))
                  : std::string("does not oscillate"),
      m.value("travel_percent_per_hour", 0.0), m.value("reversals_per_hour", 0.0),
      m.at("stick_percent").is_number()
          ? fmt::format("{:.1f} % ({})", m.at("stick_percent").get<double>(),
                        m.value("stick_source", ""))
          : std::string("-"));
}

// The condition indices, 100 good and 0 bad.
std::string condition_line(const nlohmann::json& loop) {
  const auto& condition = loop.at("monitor").at("condition");
  const auto index = [&](const char* key) {
    const auto& value = condition.at(key);
    return value.is_number() ? fmt::format("{:.0f}", value.get<double>()) : std::string("-");
  };
  return fmt::format(
      "condition (100 good, 0 bad, - not known): control performance {}   valve {}   actuator {}   "
      "positioner {}   environment {}",
      index("control_performance"), index("valve"), index("actuator"), index("positioner"),
      index("environment"));
}

}  // namespace

void TrendBuffer::update(DaemonClient& daemon) {
  const std::uint64_t from = rows_.period.empty() ? 0 : rows_.period.back() + 1;
  Trend fresh = daemon.trend(loop_, from);
  rows_.sample_time_s = fresh.sample_time_s;
  rows_.period.insert(rows_.period.end(), fresh.period.begin(), fresh.period.end());
  if (rows_.period.size() > kKept) {
    rows_.period.erase(rows_.period.begin(),
                       rows_.period.end() - static_cast<std::ptrdiff_t>(kKept));
  }
  append_tail(rows_.sp, fresh.sp, kKept);
  append_tail(rows_.pv, fresh.pv, kKept);
  append_tail(rows_.co, fresh.co, kKept);
  append_tail(rows_.stem, fresh.stem, kKept);
}

std::string quantity(const nlohmann::json& value, const std::string& unit) {
  if (!value.is_number()) return "-";
  return fmt::format("{:.3f} {}", value.get<double>(), unit);
}

std::string daemon_line(const nlohmann::json& status) {
  const auto& d = status.at("daemon");
  const auto& wake = d.at("wake_up_us");
  const double accelerate = d.at("accelerate").get<double>();
  std::string line = fmt::format(
      "loopwardend {}  up {}{}  cycles {}  overruns {}  wake-up p50 {:.0f} p99 {:.0f} worst {:.0f} "
      "us",
      d.at("version").get<std::string>(), duration(d.at("uptime_s").get<double>()),
      accelerate == 1.0 ? "" : fmt::format("  {:g} x real time", accelerate),
      d.at("ticks").get<std::uint64_t>(), d.at("overruns").get<std::uint64_t>(),
      wake.at("p50").get<double>(), wake.at("p99").get<double>(), wake.at("worst").get<double>());
  std::size_t waiting = 0;
  for (const auto& loop : status.at("loops")) {
    for (const auto& alarm : loop.value("alarms", nlohmann::json::object())) {
      waiting += alarm.value("unacknowledged", false) ? 1U : 0U;
    }
  }
  if (waiting > 0) {
    line += coloured(fmt::format("  {} alarm{} to acknowledge", waiting, waiting == 1 ? "" : "s"),
                     Colour::red);
  }
  const nlohmann::json files = d.value("configuration", nlohmann::json::object());
  const auto keys = [&](const char* list) {
    return files.contains(list) ? files.at(list).size() : std::size_t{0};
  };
  std::vector<std::string> not_in_force;
  if (!files.value("refused", std::string()).empty()) not_in_force.emplace_back("files refused");
  if (const std::size_t n = keys("waiting_for_restart")) {
    not_in_force.push_back(fmt::format("{} key{} for a restart", n, n == 1 ? "" : "s"));
  }
  if (const std::size_t n = keys("waiting_for_output")) {
    not_in_force.push_back(fmt::format("{} key{} for CO inside new limits", n, n == 1 ? "" : "s"));
  }
  if (!not_in_force.empty()) {
    line += coloured(fmt::format("  configuration waits: {}", fmt::join(not_in_force, ", ")),
                     Colour::yellow);
  }
  if (!d.at("real_time_missing").get<std::string>().empty()) {
    line += coloured("  no real-time rights", Colour::yellow);
  }
  return line;
}

std::vector<std::string> disk_troubles(const nlohmann::json& status) {
  std::vector<std::string> lines;
  for (const char* what : {"journal", "evidence"}) {
    const auto& disk = status.at("daemon").at(what);
    const auto why = disk.at("error").get<std::string>();
    if (why.empty()) continue;
    lines.push_back(fmt::format("{} not written ({} waiting in memory, {} lost): {}", what,
                                disk.at("waiting").get<std::uint64_t>(),
                                disk.at("lost").get<std::uint64_t>(), why));
  }
  return lines;
}

std::string alarm_summary(const nlohmann::json& loop) {
  std::string text;
  for (const auto& alarm : loop.value("alarms", nlohmann::json::object())) {
    const std::string state = alarm.value("state", "normal");
    if (state == "normal" || state == "suppressed") continue;
    const std::string severity =
        alarm.value("active", false) && alarm.at("severity_percent").is_number()
            ? fmt::format(" {:.1f} %", alarm.at("severity_percent").get<double>())
            : std::string();
    text += fmt::format("{}{}{} ({})", text.empty() ? "" : ", ", alarm.value("alarm", ""), severity,
                        state);
  }
  return text;
}

std::string suppressed_note(const nlohmann::json& answer) {
  const auto& alarms = answer.at("alarms");
  const auto count = std::count_if(alarms.begin(), alarms.end(), [](const nlohmann::json& alarm) {
    return alarm.at("state") == "suppressed" && !alarm.at("active").get<bool>();
  });
  if (count == 0) return {};
  return fmt::format(
      "{} can't be raised at present, which is no fault: windows are still filling (minutes after "
      "a start "
      "or a change of mode) or can't be judged, or another alarm of the valve explains {} (--all "
      "lists "
      "{})\n",
      count == 1 ? "1 alarm" : fmt::format("{} alarms", count), count == 1 ? "it" : "them",
      count == 1 ? "it" : "them");
}

std::vector<std::string> loop_table(const nlohmann::json& status, std::size_t selected) {
  std::vector<std::string> lines{
      coloured(fmt::format("  {:<14} {:<9} {:>16} {:>16} {:>14} {:>14}  {}", "LOOP", "MODE", "SP",
                           "PV", "CO", "STEM", "STATE"),
               Colour::grey)};
  const auto& loops = status.at("loops");
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto& loop = loops[i];
    const std::string pv_unit = loop.value("pv_unit", "");
    const std::string co_unit = loop.value("co_unit", "");
    const std::string mode = loop.value("mode", "-");
    const std::string fault = loop.value("fault", "starting");
    std::string state = fault == "none" ? std::string("ok") : fault;
    if (loop.value("pv_quality", "good") != "good") {
      state +=
          fmt::format(" (PV {}: {})", loop.value("pv_quality", ""), loop.value("pv_reason", ""));
    }
    if (const std::string end = loop.value("pv_limit", "none"); end != "none") {
      state += fmt::format(", PV at its {} limit", end);
    }
    if (loop.value("at_low", false) || loop.value("at_high", false))
      state += ", output at its limit";
    if (loop.contains("jacket") && loop["jacket"].value("form", "off") != "off") {
      state += fmt::format(", jacket {}{}", loop["jacket"].value("form", ""),
                           loop["jacket"].value("acting", false) ? " acting" : " idle");
    }
    if (loop.contains("compensator") && loop["compensator"].value("kind", "none") != "none") {
      const auto& compensator = loop["compensator"];
      state += compensator.value("acting", false)
                   ? fmt::format(", {} adds {:.3g} {}", compensator.value("kind", ""),
                                 compensator.value("added", 0.0), co_unit)
                   : fmt::format(", {} idle", compensator.value("kind", ""));
    }
    const std::string alarms = alarm_summary(loop);
    std::string shown = coloured(state, fault == "none" ? Colour::plain : Colour::red);
    if (!alarms.empty()) shown += ", " + coloured("ALARM " + alarms, Colour::red);
    lines.push_back(fmt::format("{} {:<14} {} {:>16} {:>16} {:>14} {:>14}  {}",
                                i == selected ? ">" : " ", loop.value("name", ""),
                                coloured(fmt::format("{:<9}", mode), mode_colour(mode)),
                                quantity(loop.value("sp", nlohmann::json()), pv_unit),
                                quantity(loop.value("pv", nlohmann::json()), pv_unit),
                                quantity(loop.value("co", nlohmann::json()), co_unit),
                                quantity(loop.value("stem", nlohmann::json()), co_unit), shown));
  }
  return lines;
}

std::vector<std::string> loop_details(const nlohmann::json& loop) {
  return {valve_line(loop), condition_line(loop), record_and_bus_line(loop)};
}

std::size_t loop_index(const nlohmann::json& status, const std::string& name) {
  const auto& loops = status.at("loops");
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (loops[i].at("name") == name) return i;
  }
  std::vector<std::string> tags;
  for (const auto& loop : loops) tags.push_back(loop.at("name").get<std::string>());
  throw DaemonRefused(kExitUsage, fmt::format("the daemon has no loop '{}'{}", name,
                                              config::suggestion(name, tags)));
}

std::vector<std::string> trend_view(const nlohmann::json& loop, const Trend& trend, double window_s,
                                    int columns, int rows) {
  const int dots = 2 * std::max(columns - kScaleColumns, 1);
  const double samples = window_s / std::max(trend.sample_time_s, 1e-3);
  const int per_dot = std::max(static_cast<int>(std::ceil(samples / dots)), 1);
  const auto shown = static_cast<std::size_t>(dots) * static_cast<std::size_t>(per_dot);
  // The range that is on the screen, at least a tenth of the span.
  const auto scale = [&](const std::vector<double>& a, const std::vector<double>& b, double low,
                         double high) {
    double least = high;
    double most = low;
    for (const auto* values : {&a, &b}) {
      const std::size_t first = values->size() > shown ? values->size() - shown : 0;
      for (std::size_t i = first; i < values->size(); ++i) {
        if (!std::isfinite((*values)[i])) continue;
        least = std::min(least, (*values)[i]);
        most = std::max(most, (*values)[i]);
      }
    }
    if (least > most) return std::pair(low, high);
    const double margin =
        std::max(0.1 * (most - least), 0.05 * (high - low) - (most - least) / 2.0);
    return std::pair(std::max(low, least - margin), std::min(high, most + margin));
  };
  const int upper = std::max((rows - 2) * 3 / 5, 3);
  const int lower = std::max(rows - 2 - upper, 3);
  const auto pv_range = loop.at("pv_range").get<std::vector<double>>();
  const auto co_range = loop.at("co_range").get<std::vector<double>>();
  const auto [pv_low, pv_high] = scale(trend.pv, trend.sp, pv_range[0], pv_range[1]);
  const auto [co_low, co_high] = scale(trend.co, trend.stem, co_range[0], co_range[1]);

  std::vector<std::string> lines;
  const double shown_s = trend.sample_time_s * static_cast<double>(shown);
  lines.push_back(
      fmt::format("{} {}   {}   {}", coloured("━", Colour::green), "PV",
                  coloured("━", Colour::grey) + " SP  [" + loop.value("pv_unit", "") + "]",
                  coloured(fmt::format("{:.0f} s", shown_s), Colour::grey)));
  const std::vector<Series> above{{trend.sp, Colour::grey}, {trend.pv, Colour::green}};
  auto part = plot(above, pv_low, pv_high, columns, upper, per_dot);
  std::move(part.begin(), part.end(), std::back_inserter(lines));
  lines.push_back(coloured("━", Colour::cyan) + " CO   " + coloured("━", Colour::magenta) +
                  " stem  [" + loop.value("co_unit", "") + "]");
  const std::vector<Series> below{{trend.co, Colour::cyan}, {trend.stem, Colour::magenta}};
  part = plot(below, co_low, co_high, columns, lower, per_dot);
  std::move(part.begin(), part.end(), std::back_inserter(lines));
  return lines;
}

}  // namespace loopwarden::workbench
