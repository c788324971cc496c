// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/metrics.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <system_error>
#include <utility>

#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

using nlohmann::json;

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
  // `labels` without braces; what is no number is left out.
  void sample(const char* name, const std::string& labels, const json& value, double factor = 1.0) {
    double number = 0.0;
    if (value.is_boolean()) {
      number = value.get<bool>() ? 1.0 : 0.0;
    } else if (value.is_number()) {
      number = value.get<double>() * factor;
    } else {
      return;
    }
    fmt::format_to(std::back_inserter(text_), "loopwarden_{}{}{}{} {:.10g}\n", name,
                   labels.empty() ? "" : "{", labels, labels.empty() ? "" : "}", number);
  }
  void single(const char* name, const char* type, const char* help, const json& value) {
    family(name, type, help);
    sample(name, {}, value);
  }
  void histogram(const char* name, const char* help, const json& of) {
    family(name, "histogram", help);
    const std::string base = name;
    const json& bins = of.at("bins");
    double below = 0.0;
    double edge_s = 1e-6;
    for (std::size_t i = 0; i + 1 < bins.size(); ++i) {
      edge_s *= 2.0;
      below += bins[i].get<double>();
      sample((base + "_bucket").c_str(), fmt::format("le=\"{:g}\"", edge_s), below);
    }
    below += bins.empty() ? 0.0 : bins.back().get<double>();
    sample((base + "_bucket").c_str(), "le=\"+Inf\"", below);
    sample((base + "_sum").c_str(), {}, of.at("sum"), 1e-6);
    sample((base + "_count").c_str(), {}, below);
  }
  void append(Page& other) { text_ += std::exchange(other.text_, {}); }
  void reserve(std::size_t more) { text_.reserve(text_.size() + more); }
  std::size_t size() const noexcept { return text_.size(); }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

struct LoopValue {
  const char* name;
  const char* type;
  const char* help;
  const char* section;  // nullptr: of the loop itself
  const char* key;
};

constexpr LoopValue kLoopValues[] = {
    {"process_variable", "gauge", "PV, in the loop's units", nullptr, "pv"},
    {"set_point", "gauge", "SP, in PV units", nullptr, "sp"},
    {"controller_output", "gauge", "CO, in the loop's units", nullptr, "co"},
    {"valve_position", "gauge", "as read back, CO units", nullptr, "stem"},
    {"jacket_rate", "gauge", "what the jacket adds to the integral, CO units/s", "jacket", "rate"},
    {"compensator_added", "gauge", "what the compensator adds to CO, CO units", "compensator",
     "added"},
    {"orders_refused_total", "counter",
     "orders that were let in and could not act any more when the loop took them", nullptr,
     "orders_refused"},
    {"bus_connected", "gauge", "1: every device of the loop answers", "io", "connected"},
    {"bus_transactions_total", "counter", "requests to devices", "io", "transactions"},
    {"bus_timeouts_total", "counter", "requests without a reply in time", "io", "timeouts"},
    {"bus_invalid_replies_total", "counter", "replies that answer no request", "io",
     "invalid_replies"},
    {"bus_exceptions_total", "counter", "errors that devices answered", "io", "device_exceptions"},
    {"bus_reconnects_total", "counter", "connections made anew", "io", "reconnects"},
    {"bus_write_errors_total", "counter", "commands that a device did not confirm", "io",
     "write_errors"},
    {"window_variability_percent", "gauge",
     "standard deviation of SP - PV in a window, of the PV span", "monitor", "variability_percent"},
    {"window_mean_error_percent", "gauge", "mean of SP - PV in a window, of the PV span", "monitor",
     "mean_error_percent"},
    {"oscillation_index", "gauge", "above 1: PV oscillates", "monitor", "oscillation_index"},
    {"valve_stick_percent", "gauge",
     "travel of CO after a turn before the valve follows, of the CO span; left out where it is not "
     "measured",
     "monitor", "stick_percent"},
    {"valve_travel_percent_per_hour", "gauge",
     "path of the stem, or of CO without a read-back, of the CO span", "monitor",
     "travel_percent_per_hour"},
    {"valve_reversals_per_hour", "gauge", "turns of that path", "monitor", "reversals_per_hour"},
    {"windows_total", "counter", "windows that the monitor judged", "monitor", "windows"},
    {"recording_dropped_total", "counter", "rows that found the ring full", "recording", "dropped"},
    {"recording_waiting", "gauge", "rows that wait for the disk", "recording", "waiting"},
    {"recording_queue_dropped_total", "counter",
     "rows that found the recorder's queue full: the disk hangs", "recording", "queue_dropped"},
    {"recording_lost_total", "counter", "rows that the disk refused", "recording", "rows_lost"}};

// The families with samples of every loop, filled loop by loop.
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

  void add(const json& loop) {
    const std::string label =
        fmt::format("loop=\"{}\"", escaped(loop.at("name").get<std::string>()));
    input_age_.sample("input_age_seconds", label + ",input=\"process_variable\"",
                      loop.value("pv_age_ms", json()), 1e-3);
    input_age_.sample("input_age_seconds", label + ",input=\"valve_position\"",
                      loop.value("position_age_ms", json()), 1e-3);
    if (loop.contains("fault")) {
      fault_.sample("fault", label + fmt::format(",fault=\"{}\"", loop["fault"].get<std::string>()),
                    1);
    }
    if (loop.contains("mode")) automatic_.sample("automatic", label, loop["mode"] == "AUTO");
    const json alarms = loop.value("alarms", json::object());
    for (const auto& [alarm, state] : alarms.items()) {
      alarm_.sample("alarm_active", label + fmt::format(",alarm=\"{}\"", alarm),
                    state.at("active"));
    }
    for (const auto& [index, value] : loop.at("monitor").at("condition").items()) {
      condition_.sample("condition_index", label + fmt::format(",of=\"{}\"", index), value);
    }
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const LoopValue& value = kLoopValues[i];
      if (value.section != nullptr && !loop.contains(value.section)) continue;
      const json& section = value.section == nullptr ? loop : loop.at(value.section);
      values_[i].sample(value.name, label, section.value(value.key, json()));
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

std::string metrics_text(const json& d, std::size_t loops,
                         const std::function<json(std::size_t)>& loop) {
  Page page;
  page.family("build_info", "gauge", "1, with the version");
  page.sample("build_info", fmt::format("version=\"{}\"", d.at("version").get<std::string>()), 1);
  page.single("uptime_seconds", "gauge", "since the start", d.at("uptime_s"));
  page.single("ticks_total", "counter", "wake-ups of the loop thread", d.at("ticks"));
  page.single("overruns_total", "counter", "ticks that began more than a tick late",
              d.at("overruns"));
  page.single("skipped_ticks_total", "counter", "ticks left out by overruns",
              d.at("skipped_ticks"));
  page.single("real_time_rights", "gauge", "1: real-time priority and locked memory were granted",
              d.at("real_time_missing").get<std::string>().empty());
  page.histogram("wake_up_seconds", "from a deadline to the first instruction after it",
                 d.at("wake_up_us"));
  page.histogram("work_seconds", "all loops of a tick", d.at("work_us"));
  page.single("events_dropped_total", "counter", "events that found the ring full",
              d.at("events_dropped"));
  page.single("recorder_disk_wait_seconds", "gauge",
              "for how long the recorder's disk has not answered",
              d.at("recorder").at("disk_wait_s"));
  page.single("log_lines_lost_total", "counter", "lines that the log had no room for",
              d.at("log_lines_lost"));
  page.single("journal_lost_total", "counter", "lines of the journal that found no room",
              d.at("journal").at("lost"));
  page.single("journal_waiting", "gauge", "lines of the journal that wait for the disk",
              d.at("journal").at("waiting"));

  LoopPages pages;
  for (std::size_t i = 0; i < loops; ++i) pages.add(loop(i));
  pages.append_to(page);
  return page.take();
}

bool write_metrics(const std::filesystem::path& path, const std::string& text) {
  // Written anew every few seconds: not worth a wait for the disk.
  return !base::replace_file(path, text, {.wait_for_disk = false, .prepare = [](int fd) {
                                            constexpr mode_t kEveryoneReads = 0644;
                                            ::fchmod(fd, kEveryoneReads);
                                          }});
}

}  // namespace loopwarden::daemon
