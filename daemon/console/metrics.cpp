// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/metrics.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

using protocol::Cycle;
using protocol::Io;
using protocol::LoopStatus;
using protocol::Monitor;
using protocol::Recording;

std::string escaped(const std::string& label) {
  std::string text;
  for (const char c : label) {
    if (c == '\\' || c == '"') text += '\\';
    if (c == '\n') {
      text += "\\n";
    } else {
      text += c;
    }
  }
  return text;
}

class Page {
 public:
  void family(const char* name, const char* type, const char* help) {
    fmt::format_to(std::back_inserter(text_),
                   "# HELP loopwarden_{0} {2}\n# TYPE loopwarden_{0} {1}\n", name, type, help);
  }
  // `labels` without braces. Values that are not numbers are omitted.
  void sample(const char* name, const std::string& labels, double value) {
    if (!std::isfinite(value)) return;
    fmt::format_to(std::back_inserter(text_), "loopwarden_{}{}{}{} {:.10g}\n", name,
                   labels.empty() ? "" : "{", labels, labels.empty() ? "" : "}", value);
  }
  template <class Value>
  void single(const char* name, const char* type, const char* help, Value value) {
    family(name, type, help);
    sample(name, {}, static_cast<double>(value));
  }
  void histogram(const char* name, const char* help, const protocol::Histogram& of) {
    family(name, "histogram", help);
    const std::string base = name;
    double below = 0.0;
    double edge_s = 1e-6;
    for (std::size_t i = 0; i + 1 < of.bins.size(); ++i) {
      edge_s *= 2.0;
      below += static_cast<double>(of.bins[i]);
      sample((base + "_bucket").c_str(), fmt::format("le=\"{:g}\"", edge_s), below);
    }
    below += of.bins.empty() ? 0.0 : static_cast<double>(of.bins.back());
    sample((base + "_bucket").c_str(), "le=\"+Inf\"", below);
    sample((base + "_sum").c_str(), {}, of.sum * 1e-6);
    sample((base + "_count").c_str(), {}, below);
  }
  void append(Page& other) { text_ += std::exchange(other.text_, {}); }
  void reserve(std::size_t more) { text_.reserve(text_.size() + more); }
  std::size_t size() const noexcept { return text_.size(); }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

// Returns a member of a loop's status, or of a part of it.
template <auto... member>
double of_loop(const LoopStatus& loop) {
  return static_cast<double>((loop.*....*member));
}
// Returns the same for its newest cycle; NaN before the first one.
template <auto... member>
double of_cycle(const LoopStatus& loop) {
  return loop.cycle ? (*loop.cycle.*....*member) : protocol::kNone;
}

struct LoopValue {
  const char* name;
  const char* type;
  const char* help;
  double (*value)(const LoopStatus& loop);
};

constexpr LoopValue kLoopValues[] = {
    {"process_variable", "gauge", "PV, in the loop's units", of_cycle<&Cycle::pv>},
    {"set_point", "gauge", "SP, in PV units", of_cycle<&Cycle::sp>},
    {"controller_output", "gauge", "CO, in the loop's units", of_cycle<&Cycle::co>},
    {"valve_position", "gauge", "as read back, CO units", of_cycle<&Cycle::stem>},
    {"jacket_rate", "gauge", "what the jacket adds to the integral, CO units/s",
     of_cycle<&Cycle::jacket, &protocol::Jacket::rate>},
    {"compensator_added", "gauge", "what the compensator adds to CO, CO units",
     of_cycle<&Cycle::compensator, &protocol::Compensator::added>},
    {"orders_refused_total", "counter",
     "orders that were let in and could not act any more when the loop took them",
     of_loop<&LoopStatus::orders_refused>},
    {"bus_connected", "gauge", "1: every device of the loop answers",
     of_loop<&LoopStatus::io, &Io::connected>},
    {"bus_transactions_total", "counter", "requests to devices",
     of_loop<&LoopStatus::io, &Io::transactions>},
    {"bus_timeouts_total", "counter", "requests without a reply in time",
     of_loop<&LoopStatus::io, &Io::timeouts>},
    {"bus_invalid_replies_total", "counter", "replies that answer no request",
     of_loop<&LoopStatus::io, &Io::invalid_replies>},
    {"bus_exceptions_total", "counter", "errors that devices answered",
     of_loop<&LoopStatus::io, &Io::device_exceptions>},
    {"bus_reconnects_total", "counter", "connections made anew",
     of_loop<&LoopStatus::io, &Io::reconnects>},
    {"bus_write_errors_total", "counter", "commands that a device did not confirm",
     of_loop<&LoopStatus::io, &Io::write_errors>},
    {"window_variability_percent", "gauge",
     "standard deviation of SP - PV in a window, of the PV span",
     of_loop<&LoopStatus::monitor, &Monitor::variability_percent>},
    {"window_mean_error_percent", "gauge", "mean of SP - PV in a window, of the PV span",
     of_loop<&LoopStatus::monitor, &Monitor::mean_error_percent>},
    {"oscillation_index", "gauge", "above 1: PV oscillates",
     of_loop<&LoopStatus::monitor, &Monitor::oscillation_index>},
    {"valve_stick_percent", "gauge",
     "travel of CO after a turn before the valve follows, of the CO span; left out where it is not "
     "measured",
     of_loop<&LoopStatus::monitor, &Monitor::stick_percent>},
    {"valve_travel_percent_per_hour", "gauge",
     "path of the stem, or of CO without a read-back, of the CO span",
     of_loop<&LoopStatus::monitor, &Monitor::travel_percent_per_hour>},
    {"valve_reversals_per_hour", "gauge", "turns of that path",
     of_loop<&LoopStatus::monitor, &Monitor::reversals_per_hour>},
    {"windows_total", "counter", "windows that the monitor judged",
     of_loop<&LoopStatus::monitor, &Monitor::windows>},
    {"recording_dropped_total", "counter", "rows that found the ring full",
     of_loop<&LoopStatus::recording, &Recording::dropped>},
    {"recording_waiting", "gauge", "rows that wait for the disk",
     of_loop<&LoopStatus::recording, &Recording::waiting>},
    {"recording_queue_dropped_total", "counter",
     "rows that found the recorder's queue full: the disk hangs",
     of_loop<&LoopStatus::recording, &Recording::queue_dropped>},
    {"recording_lost_total", "counter", "rows that the disk refused",
     of_loop<&LoopStatus::recording, &Recording::rows_lost>}};

// Metric families with one sample per loop.
class LoopPages {
 public:
  LoopPages() {
    input_age_.family("input_age_seconds", "gauge",
                      "age of the newest sample that the loop has seen");
    fault_.family("fault", "gauge", "1 for the fault that a loop has, or none");
    automatic_.family("automatic", "gauge", "1: the loop is in automatic");
    alarm_.family("alarm_active", "gauge", "1: the condition of the alarm is there");
    condition_.family("condition_index", "gauge",
                      "100 good, 0 bad; left out where it is not known");
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i].family(kLoopValues[i].name, kLoopValues[i].type, kLoopValues[i].help);
    }
  }

  void add(const LoopStatus& loop) {
    const std::string label = fmt::format("loop=\"{}\"", escaped(loop.name));
    input_age_.sample("input_age_seconds", label + ",input=\"process_variable\"",
                      1e-3 * of_cycle<&Cycle::pv_age_ms>(loop));
    input_age_.sample("input_age_seconds", label + ",input=\"valve_position\"",
                      1e-3 * loop.position_age_ms);
    if (loop.cycle) {
      fault_.sample("fault", label + fmt::format(",fault=\"{}\"", loop.cycle->fault), 1.0);
      automatic_.sample("automatic", label, loop.cycle->mode == "AUTO" ? 1.0 : 0.0);
    }
    for (const auto& [name, alarm] : loop.alarms) {
      alarm_.sample("alarm_active", label + fmt::format(",alarm=\"{}\"", name),
                    alarm.active ? 1.0 : 0.0);
    }
    const protocol::Condition& condition = loop.monitor.condition;
    for (const auto& [of, index] : {std::pair("actuator", condition.actuator),
                                    {"control_performance", condition.control_performance},
                                    {"environment", condition.environment},
                                    {"positioner", condition.positioner},
                                    {"valve", condition.valve}}) {
      condition_.sample("condition_index", label + fmt::format(",of=\"{}\"", of), index);
    }
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i].sample(kLoopValues[i].name, label, kLoopValues[i].value(loop));
    }
  }

  void append_to(Page& page) {
    page.reserve(std::accumulate(
        values_.begin(), values_.end(),
        input_age_.size() + fault_.size() + automatic_.size() + alarm_.size() + condition_.size(),
        [](std::size_t sum, const Page& family) { return sum + family.size(); }));
    for (Page* family : {&input_age_, &fault_, &automatic_, &alarm_, &condition_}) {
      page.append(*family);
    }
    for (Page& family : values_) page.append(family);
  }

 private:
  Page input_age_, fault_, automatic_, alarm_, condition_;
  std::array<Page, std::size(kLoopValues)> values_;
};

}  // namespace

std::string metrics_text(const protocol::DaemonStatus& daemon, std::size_t loops,
                         const std::function<LoopStatus(std::size_t)>& loop) {
  Page page;
  page.family("build_info", "gauge", "1, with the version");
  page.sample("build_info", fmt::format("version=\"{}\"", daemon.version), 1.0);
  page.single("uptime_seconds", "gauge", "since the start", daemon.uptime_s);
  page.single("ticks_total", "counter", "wake-ups of the loop thread", daemon.ticks);
  page.single("overruns_total", "counter", "ticks that began more than a tick late",
              daemon.overruns);
  page.single("skipped_ticks_total", "counter", "ticks left out by overruns", daemon.skipped_ticks);
  page.single("real_time_rights", "gauge", "1: real-time priority and locked memory were granted",
              daemon.real_time_missing.empty());
  page.histogram("wake_up_seconds", "from a deadline to the first instruction after it",
                 daemon.wake_up_us);
  page.histogram("work_seconds", "all loops of a tick", daemon.work_us);
  page.single("events_dropped_total", "counter", "events that found the ring full",
              daemon.events_dropped);
  page.single("recorder_disk_wait_seconds", "gauge",
              "for how long the recorder's disk has not answered", daemon.recorder.disk_wait_s);
  page.single("recording_sync_seconds", "gauge", "between two writes of rows to the disk",
              daemon.recorder.sync_s);
  page.single("written_bytes_total", "counter", "that the daemon has passed to disks",
              daemon.recorder.written_bytes);
  page.single("write_budget_bytes_per_day", "gauge", "above it the alarm disk_writes is raised",
              1e6 * daemon.recorder.write_budget_mb_per_day);
  page.single("log_lines_lost_total", "counter", "lines that the log had no room for",
              daemon.log_lines_lost);
  page.single("journal_lost_total", "counter", "lines of the journal that found no room",
              daemon.journal.lost);
  page.single("journal_waiting", "gauge", "lines of the journal that wait for the disk",
              daemon.journal.waiting);

  LoopPages pages;
  for (std::size_t i = 0; i < loops; ++i) pages.add(loop(i));
  pages.append_to(page);
  return page.take();
}

bool write_metrics(const std::filesystem::path& path, const std::string& text) {
  // The file is replaced every few seconds, so there is no wait for the disk.
  return !base::replace_file(path, text, {.wait_for_disk = false, .prepare = [](int fd) {
                                            constexpr mode_t kEveryoneReads = 0644;
                                            ::fchmod(fd, kEveryoneReads);
                                          }});
}

}  // namespace loopwarden::daemon
