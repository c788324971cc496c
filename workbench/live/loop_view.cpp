// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/loop_view.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <iterator>
#include <utility>

#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench {
namespace {

template <class T>
void append_tail(std::vector<T>& to, const std::vector<T>& from, std::size_t most) {
  to.insert(to.end(), from.begin(), from.end());
  if (to.size() > most) to.erase(to.begin(), to.end() - static_cast<std::ptrdiff_t>(most));
}

bool is_watched(const protocol::LoopStatus& loop) { return loop.control == "elsewhere"; }

// Returns the mode as shown. A watched loop has no fallback: its mode has another value than those
// of the loop file, or does not arrive.
std::string mode_of(const protocol::LoopStatus& loop, const protocol::Cycle& cycle) {
  if (!is_watched(loop) || cycle.mode != "FALLBACK") return cycle.mode;
  return cycle.pv_quality == "bad" ? "-" : "OTHER";
}

Colour mode_colour(const std::string& mode) {
  if (mode == "AUTO" || mode == "-") return Colour::plain;
  return mode == "FALLBACK" ? Colour::red : Colour::yellow;
}

std::string duration(double seconds) {
  const auto s = static_cast<long>(seconds);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

// Returns "value unit", or a dash without a value.
std::string quantity(double value, const std::string& unit) {
  return std::isfinite(value) ? fmt::format("{:.3f} {}", value, unit) : std::string("-");
}

std::string rounded(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("-");
}

std::string record_and_bus_line(const protocol::LoopStatus& loop) {
  const protocol::Io& io = loop.io;
  const protocol::Recording& recording = loop.recording;
  const protocol::Cycle cycle = loop.cycle.value_or(protocol::Cycle{});
  return fmt::format(
      "{}: {}{}   PV age {} ms   position age {} ms   recorded {} rows, {} lost, {:.1f} MB   bus: "
      "{} "
      "transactions, {} "
      "timeouts, "
      "{} exceptions, {} invalid, {} reconnects",
      loop.name, loop.description, is_watched(loop) ? " (controlled elsewhere)" : "",
      rounded(cycle.pv_age_ms, 1), rounded(loop.position_age_ms, 1), recording.rows,
      recording.dropped + recording.queue_dropped + recording.rows_lost,
      static_cast<double>(recording.bytes) / 1e6, io.transactions, io.timeouts,
      io.device_exceptions, io.invalid_replies, io.reconnects);
}

// Returns the monitor's result for the loop's valve.
std::string valve_line(const protocol::LoopStatus& loop) {
  const protocol::Monitor& m = loop.monitor;
  return fmt::format(
      "valve: {}   window {}: {}   variability {:.2f} %   {}   travel {:.0f} %/h   {:.0f} "
      "reversals/h   stick {}",
      loop.cycle.value_or(protocol::Cycle{}).ne107, m.windows, m.window_state,
      m.variability_percent,
      m.oscillation_index > 1.0 ? fmt::format("oscillates at {:.1f} s", m.oscillation_period_s)
                                : std::string("no oscillation within it"),
      m.travel_percent_per_hour, m.reversals_per_hour,
      std::isfinite(m.stick_percent) ? fmt::format("{:.1f} % ({})", m.stick_percent, m.stick_source)
                                     : std::string("-"));
}

std::string commissioning_line(const protocol::Commissioned& holder) {
  return fmt::format(
      "in maintenance by {} since {:%FT%TZ}; other users can only select manual; {}", holder.by,
      fmt::gmtime(static_cast<std::time_t>(holder.since_ms / 1000)),
      holder.ends_in_s > 0.0
          ? fmt::format("ends in {:.0f} s if the session stays silent", holder.ends_in_s)
          : std::string("session silent: stop action"));
}

// Returns the condition indices, from 0 (bad) to 100 (good).
std::string condition_line(const protocol::LoopStatus& loop) {
  const protocol::Condition& c = loop.monitor.condition;
  return fmt::format(
      "condition (100 good, 0 bad, - unknown): control performance {}   valve {}   actuator {}   "
      "positioner {}   environment {}",
      rounded(c.control_performance, 0), rounded(c.valve, 0), rounded(c.actuator, 0),
      rounded(c.positioner, 0), rounded(c.environment, 0));
}

// Returns "12 min", "3.5 h" or "4.0 d".
std::string age(double seconds) {
  if (seconds < 7200.0) return fmt::format("{:.0f} min", seconds / 60.0);
  if (seconds < 172'800.0) return fmt::format("{:.1f} h", seconds / 3600.0);
  return fmt::format("{:.1f} d", seconds / 86'400.0);
}

// Returns the state of routine evidence and its next judgement, for the shortest windows and for
// those that were judged.
std::vector<std::string> routine_lines(const protocol::LoopStatus& loop) {
  std::vector<std::string> lines;
  for (const protocol::RoutineLevel& level : loop.monitor.routine) {
    if (level.windows == 0 && !lines.empty()) continue;
    std::string line = fmt::format("routine evidence, windows of {}: ", age(level.window_s));
    if (level.windows == 0) {
      line += "none judged yet";
    } else {
      line += fmt::format(
          "{} judged, newest: {}, probability of a valve effect {:.2f}   {:.0f} % of the alarm "
          "threshold",
          level.windows, base::in_words(level.verdict), level.probability,
          100.0 * std::min(level.evidence, 1.0));
    }
    lines.push_back(line + fmt::format("   next after {} in automatic", age(level.next_in_s)));
  }
  return lines;
}

// Returns the kinds of change that could not have been detected for an hour or more.
std::string untested_text(const protocol::TwinRemarks& twin) {
  constexpr double kWorthSaying_s = 3600.0;
  std::string text;
  for (const protocol::UntestedRemark& one : twin.untested) {
    if (one.for_s < kWorthSaying_s) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", base::in_words(one.change),
                        one.tested ? age(one.for_s) + " ago"
                                   : fmt::format("not in {} since the start", age(one.for_s)));
  }
  return text;
}

std::string twin_line(const protocol::LoopStatus& loop) {
  const protocol::TwinRemarks& twin = *loop.monitor.twin;
  std::string line = "twin: ";
  line += twin.judging == "here"      ? "judges"
          : twin.judging == "outside" ? "not judging (PV or CO outside the commissioned range)"
                                      : "not judged yet";
  if (twin.load_outside) {
    line += fmt::format("   disturbance {:+.3g} {} outside the commissioned range for {}",
                        twin.load_outside->size, loop.pv_unit, age(twin.load_outside->since_s));
  }
  if (!twin.controller_not_watched.empty()) {
    line += fmt::format("   controller not watched: {}", twin.controller_not_watched);
  }
  const std::string untested = untested_text(twin);
  return untested.empty() ? line : line + "   last tested: " + untested;
}

// Returns the loop's alarms that are on, delayed or shelved; empty if all are normal.
std::string alarm_summary(const protocol::LoopStatus& loop) {
  std::string text;
  for (const auto& [name, alarm] : loop.alarms) {
    if (alarm.state == "normal" || alarm.state == "suppressed") continue;
    const std::string severity = alarm.active && std::isfinite(alarm.severity_percent)
                                     ? fmt::format(" {:.1f} %", alarm.severity_percent)
                                     : std::string();
    text +=
        fmt::format("{}{}{} ({})", text.empty() ? "" : ", ", alarm.alarm, severity, alarm.state);
  }
  return text;
}

// Returns fault, quality of PV, limits, jacket and compensator as text.
std::string state_of(const protocol::LoopStatus& loop, const protocol::Cycle& cycle) {
  if (is_watched(loop) && cycle.pv_quality == "bad") {
    const double age_s = cycle.pv_age_ms / 1000.0;
    if (!(age_s <= cycle.time_s)) return fmt::format("no valid PV yet ({})", cycle.pv_reason);
    return fmt::format("no valid PV for {} ({})", duration(age_s), cycle.pv_reason);
  }
  std::string state = cycle.fault == "none" ? std::string("ok") : cycle.fault;
  if (cycle.pv_quality != "good") {
    state += fmt::format(" (PV {}: {})", cycle.pv_quality, cycle.pv_reason);
  } else if (cycle.pv_reason != "none") {
    state += fmt::format(" (PV {})", cycle.pv_reason);
  }
  if (cycle.pv_limit != "none") state += fmt::format(", PV at its {} limit", cycle.pv_limit);
  if (cycle.at_low || cycle.at_high) state += ", output at its limit";
  if (cycle.jacket.form != "off") {
    state +=
        fmt::format(", jacket {}{}", cycle.jacket.form, cycle.jacket.acting ? " acting" : " idle");
  }
  const protocol::Compensator& compensator = cycle.compensator;
  if (!compensator.says.empty()) {
    state += fmt::format(", {} {}", compensator.kind, compensator.says);
  } else if (compensator.kind != "none") {
    state += compensator.acting ? fmt::format(", {} adds {:.3g} {}", compensator.kind,
                                              compensator.added, loop.co_unit)
                                : fmt::format(", {} idle", compensator.kind);
  }
  return state;
}

}  // namespace

void TrendBuffer::update(protocol::Daemon& daemon) {
  const std::uint64_t from = rows_.period.empty() ? 0 : rows_.period.back() + 1;
  const protocol::Trend fresh =
      protocol::ask(daemon, protocol::TrendRequest{.loop = loop_, .from = from});
  rows_.sample_time_s = fresh.sample_time_s;
  append_tail(rows_.period, fresh.period, kKept);
  append_tail(rows_.sp, fresh.sp, kKept);
  append_tail(rows_.pv, fresh.pv, kKept);
  append_tail(rows_.co, fresh.co, kKept);
  append_tail(rows_.stem, fresh.stem, kKept);
}

std::string daemon_line(const protocol::Status& status) {
  const protocol::DaemonStatus& d = status.daemon;
  std::string line = fmt::format(
      "loopwardend {}  up {}{}  cycles {}  overruns {}  wake-up p50 {:.0f} p99 {:.0f} worst {:.0f} "
      "us",
      d.version, duration(d.uptime_s),
      d.accelerate == 1.0 ? "" : fmt::format("  {:g} x real time", d.accelerate), d.ticks,
      d.overruns, d.wake_up_us.p50, d.wake_up_us.p99, d.wake_up_us.worst);
  std::size_t waiting = 0;
  for (const protocol::LoopStatus& loop : status.loops) {
    for (const auto& [name, alarm] : loop.alarms) waiting += alarm.unacknowledged ? 1U : 0U;
  }
  if (waiting > 0) {
    line += coloured(fmt::format("  {} alarm{} to acknowledge", waiting, waiting == 1 ? "" : "s"),
                     Colour::red);
  }
  const protocol::ConfigurationStatus& files = d.configuration;
  std::vector<std::string> not_in_force;
  if (!files.refused.empty()) not_in_force.emplace_back("files refused");
  if (const std::size_t n = files.waiting_for_restart.size()) {
    not_in_force.push_back(fmt::format("{} key{} for a restart", n, n == 1 ? "" : "s"));
  }
  if (const std::size_t n = files.waiting_for_output.size()) {
    not_in_force.push_back(fmt::format("{} key{} for CO inside new limits", n, n == 1 ? "" : "s"));
  }
  if (!not_in_force.empty()) {
    line += coloured(fmt::format("  configuration waits: {}", fmt::join(not_in_force, ", ")),
                     Colour::yellow);
  }
  if (!d.real_time_missing.empty()) line += coloured("  no real-time rights", Colour::yellow);
  return line;
}

std::string writes_line(const protocol::DaemonStatus& daemon) {
  const protocol::RecorderStatus& recorder = daemon.recorder;
  if (!std::isfinite(recorder.written_mb_per_day)) return {};
  std::string line = fmt::format("disk  {:.0f} MB a day written", recorder.written_mb_per_day);
  if (std::isfinite(recorder.write_budget_mb_per_day)) {
    line += fmt::format(", budget {:.0f} MB", recorder.write_budget_mb_per_day);
  }
  line += fmt::format("  rows every {:g} s", recorder.sync_s);
  const bool above = recorder.written_mb_per_day > recorder.write_budget_mb_per_day;
  return coloured(line, above ? Colour::yellow : Colour::grey);
}

std::vector<std::string> connection_lines(const protocol::DaemonStatus& daemon) {
  std::vector<std::string> lost;
  std::vector<std::string> partly;
  std::string up;
  for (const protocol::ConnectionStatus& one : daemon.connections) {
    const std::string loops = fmt::format("{} loop{}", one.loops, one.loops == 1 ? "" : "s");
    const std::string parts =
        one.lost.empty() ? std::string() : fmt::format(": {}", fmt::join(one.lost, ", "));
    if (!one.up) {
      lost.push_back(
          coloured(fmt::format("connection lost  {} ({}){}", one.name, loops, parts), Colour::red));
    } else if (one.silent_loops > 0) {
      partly.push_back(coloured(fmt::format("connection  {}: {} of {} without PV{}", one.name,
                                            one.silent_loops, loops, parts),
                                Colour::yellow));
    } else {
      up += fmt::format("{}{} ({})", up.empty() ? "" : ", ", one.name, loops);
    }
  }
  lost.insert(lost.end(), partly.begin(), partly.end());
  if (!up.empty()) lost.push_back(coloured("connected  " + up, Colour::grey));
  return lost;
}

std::vector<std::string> disk_troubles(const protocol::DaemonStatus& daemon) {
  std::vector<std::string> lines;
  const auto look = [&](const char* what, const auto& disk) {
    if (disk.error.empty()) return;
    lines.push_back(fmt::format("{} not written ({} waiting in memory, {} lost): {}", what,
                                disk.waiting, disk.lost, disk.error));
  };
  look("journal", daemon.journal);
  look("evidence", daemon.evidence);
  return lines;
}

std::string suppressed_note(const std::vector<protocol::Alarm>& alarms) {
  const auto count = std::count_if(alarms.begin(), alarms.end(), [](const protocol::Alarm& alarm) {
    return alarm.state == "suppressed" && !alarm.active;
  });
  if (count == 0) return {};
  return fmt::format(
      "{} cannot be raised at present. This is normal: windows are still filling (minutes after a "
      "start or a mode change), windows cannot be judged, or another alarm of the valve explains "
      "{} (--all lists {})\n",
      count == 1 ? "1 alarm" : fmt::format("{} alarms", count), count == 1 ? "it" : "them",
      count == 1 ? "it" : "them");
}

std::vector<std::string> loop_table(const std::vector<protocol::LoopStatus>& loops,
                                    std::size_t selected) {
  std::vector<std::string> lines{
      coloured(fmt::format("  {:<14} {:<9} {:>16} {:>16} {:>14} {:>14}  {}", "LOOP", "MODE", "SP",
                           "PV", "CO", "STEM", "STATE"),
               Colour::grey)};
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const protocol::LoopStatus& loop = loops[i];
    const protocol::Cycle cycle = loop.cycle.value_or(protocol::Cycle{});
    std::string shown =
        coloured(state_of(loop, cycle), cycle.fault == "none" ? Colour::plain : Colour::red);
    const std::string alarms = alarm_summary(loop);
    const std::string mode = mode_of(loop, cycle);
    if (loop.out_of_service) shown = coloured("out of service: files have errors", Colour::red);
    if (loop.commissioning) {
      shown += ", " + coloured("in maintenance by " + loop.commissioning->by, Colour::yellow);
    }
    if (!alarms.empty()) shown += ", " + coloured("ALARM " + alarms, Colour::red);
    lines.push_back(
        fmt::format("{} {:<14} {} {:>16} {:>16} {:>14} {:>14}  {}", i == selected ? ">" : " ",
                    loop.name, coloured(fmt::format("{:<9}", mode), mode_colour(mode)),
                    quantity(cycle.sp, loop.pv_unit), quantity(cycle.pv, loop.pv_unit),
                    quantity(cycle.co, loop.co_unit), quantity(cycle.stem, loop.co_unit), shown));
  }
  return lines;
}

std::string place_line(const std::vector<protocol::LoopStatus>& loops, std::size_t at) {
  const protocol::LoopStatus& loop = loops[at];
  // The master may be in another area than the listed loops.
  std::string master = loop.master;
  const auto named = [](const protocol::LoopStatus& other) {
    return fmt::format("{} ({})", other.name,
                       mode_of(other, other.cycle.value_or(protocol::Cycle{})));
  };
  std::string line;
  if (!loop.area.empty()) line += "area " + loop.area + "   ";
  std::string slaves;
  for (const protocol::LoopStatus& other : loops) {
    if (!master.empty() && other.name == loop.master) master = named(other);
    if (other.master == loop.name) slaves += (slaves.empty() ? "" : ", ") + named(other);
  }
  if (!master.empty()) line += "slave of " + master + "   ";
  if (!slaves.empty()) line += "master of " + slaves;
  return line.empty() ? line : std::string(line, 0, line.find_last_not_of(' ') + 1) + "\n";
}

std::vector<std::string> loop_details(const protocol::LoopStatus& loop) {
  std::vector<std::string> lines{valve_line(loop), condition_line(loop)};
  if (loop.out_of_service) lines.push_back("out of service: " + *loop.out_of_service);
  for (std::string& line : routine_lines(loop)) lines.push_back(std::move(line));
  if (loop.commissioning) lines.push_back(commissioning_line(*loop.commissioning));
  if (loop.monitor.twin) lines.push_back(twin_line(loop));
  lines.push_back(record_and_bus_line(loop));
  return lines;
}

std::size_t loop_index(const std::vector<protocol::LoopStatus>& loops, const std::string& name) {
  std::vector<std::string> tags;
  for (const protocol::LoopStatus& loop : loops) {
    if (loop.name == name) return tags.size();
    tags.push_back(loop.name);
  }
  throw DaemonRefused(kExitUsage, fmt::format("the daemon has no loop '{}'{}", name,
                                              config::suggestion(name, tags)));
}

std::vector<std::string> trend_view(const protocol::LoopStatus& loop, const protocol::Trend& trend,
                                    double window_s, int columns, int rows) {
  const int dots = 2 * std::max(columns - kScaleColumns, 1);
  const double samples = window_s / std::max(trend.sample_time_s, 1e-3);
  const int per_dot = std::max(static_cast<int>(std::ceil(samples / dots)), 1);
  const auto shown = static_cast<std::size_t>(dots) * static_cast<std::size_t>(per_dot);
  // Uses the range of the shown values, at least a tenth of the span.
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
  const auto [pv_low, pv_high] = scale(trend.pv, trend.sp, loop.pv_range[0], loop.pv_range[1]);
  const auto [co_low, co_high] = scale(trend.co, trend.stem, loop.co_range[0], loop.co_range[1]);

  std::vector<std::string> lines;
  const double shown_s = trend.sample_time_s * static_cast<double>(shown);
  lines.push_back(fmt::format("{} {}   {}   {}", coloured("━", Colour::green), "PV",
                              coloured("━", Colour::grey) + " SP  [" + loop.pv_unit + "]",
                              coloured(fmt::format("{:.0f} s", shown_s), Colour::grey)));
  const std::vector<Series> above{{trend.sp, Colour::grey}, {trend.pv, Colour::green}};
  auto part = plot(above, pv_low, pv_high, columns, upper, per_dot);
  std::move(part.begin(), part.end(), std::back_inserter(lines));
  lines.push_back(coloured("━", Colour::cyan) + " CO   " + coloured("━", Colour::magenta) +
                  " stem  [" + loop.co_unit + "]");
  const std::vector<Series> below{{trend.co, Colour::cyan}, {trend.stem, Colour::magenta}};
  part = plot(below, co_low, co_high, columns, lower, per_dot);
  std::move(part.begin(), part.end(), std::back_inserter(lines));
  return lines;
}

}  // namespace loopwarden::workbench
