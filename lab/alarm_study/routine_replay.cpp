// SPDX-License-Identifier: Apache-2.0
#include "lab/alarm_study/routine_replay.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "model/watch/limits.hpp"
#include "model/watch/loop_monitor.hpp"
#include "record/record_csv.hpp"
#include "lab/program/labels.hpp"

namespace loopwarden::lab {
namespace {

struct Loop {
  bool sticky = false;
  std::vector<record::Record> records;
};

// Separates two records by a gap in automatic, because the labels don't state their distance in
// time. Half a window of the first record must not continue in the second.
void rest(watch::LoopMonitor& watch, std::uint64_t& period) {
  period += 10'000'000;
  watch.add({.period_index = period++,
             .pv = std::numeric_limits<double>::quiet_NaN(),
             .automatic = true});
}

nlohmann::json watched(const std::string& name, const Loop& loop) {
  const double period_s = loop.records.front().period_s;
  watch::LoopMonitor watch({.sample_time_s = period_s}, alarm::kAlarmRule, nullptr);
  std::uint64_t period = 0;
  double passed_s = 0.0;
  nlohmann::json windows = nlohmann::json::array();
  nlohmann::json raised_s = nullptr;
  std::string alarm;
  double severity_percent = 0.0;
  for (const record::Record& r : loop.records) {
    for (std::size_t k = 0; k < r.size(); ++k) {
      passed_s += period_s;
      const watch::MonitorStep step = watch.add({.period_index = period++,
                                                 .sp = !r.sp.empty() ? r.sp[k] : 0.0,
                                                 .pv = r.pv[k],
                                                 .co = r.co[k],
                                                 .stem = std::nan(""),
                                                 .automatic = true,
                                                 .pv_good = std::isfinite(r.pv[k])});
      if (!step.routine) continue;
      windows.push_back({{"at_s", passed_s},
                         {"length_s", step.routine->window_s},
                         {"verdict", diagnosis::to_text(step.routine->verdict)},
                         {"probability", step.routine->probability},
                         {"sum", step.routine->sum}});
      for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
        if (!step.conditions[alarm::index_of(kind)].on || !raised_s.is_null()) continue;
        raised_s = passed_s;
        alarm = to_text(kind);
        severity_percent = step.conditions[alarm::index_of(kind)].severity_percent;
      }
    }
    rest(watch, period);
  }
  return {{"loop", name},
          {"sticky", loop.sticky},
          {"hours", passed_s / 3600.0},
          {"windows", std::move(windows)},
          {"raised_s", raised_s},
          {"alarm", alarm},
          {"severity_percent", severity_percent}};
}

}  // namespace

nlohmann::json replay_loops(const std::vector<std::string>& folders) {
  nlohmann::json found = nlohmann::json::array();
  for (const std::filesystem::path folder : folders) {
    std::map<std::string, Loop> loops;
    for (const Label& label : read_labels(folder / "labels.csv")) {
      Loop& loop = loops[label.loop];
      loop.sticky = label.sticky;
      loop.records.push_back(record::read_record(folder / label.file));
    }
    for (const auto& [name, loop] : loops) found.push_back(watched(name, loop));
  }
  return found;
}

void print_loops(const nlohmann::json& loops) {
  fmt::print(
      "Alarms of routine evidence on recorded loops, CO span 0 to 100. A window is {} samples; "
      "more "
      "than one must agree.\n\n",
      watch::WatchLimits::kRoutineSamples);
  fmt::print("{:<10} {:<7} {:>7} {:>8} {:>8} {:>9}  {}\n", "loop", "sticky", "hours", "windows",
             "sum", "raised h", "alarm");
  std::size_t right = 0;
  std::size_t sticky = 0;
  std::size_t wrong = 0;
  std::size_t enough = 0;
  for (const nlohmann::json& loop : loops) {
    const bool raised = !loop.at("raised_s").is_null();
    const bool bad = loop.at("sticky").get<bool>();
    const auto& windows = loop.at("windows");
    sticky += bad ? 1U : 0U;
    enough += bad && windows.size() > 1 ? 1U : 0U;
    right += bad && raised ? 1U : 0U;
    wrong += !bad && raised ? 1U : 0U;
    fmt::print(
        "{:<10} {:<7} {:>7.1f} {:>8} {:>8} {:>9}  {}\n", loop.at("loop").get<std::string>(),
        bad ? "yes" : "no", loop.at("hours").get<double>(), windows.size(),
        windows.empty() ? "-" : fmt::format("{:.1f}", windows.back().at("sum").get<double>()),
        raised ? fmt::format("{:.1f}", loop.at("raised_s").get<double>() / 3600.0) : "-",
        raised ? fmt::format("{} {:.1f} %", loop.at("alarm").get<std::string>(),
                             loop.at("severity_percent").get<double>())
               : "");
  }
  fmt::print(
      "\nalarms on {} of {} sticky loops ({} of them have more than one window), on {} of {} "
      "others\n",
      right, sticky, enough, wrong, loops.size() - sticky);
}

}  // namespace loopwarden::lab
