// SPDX-License-Identifier: Apache-2.0
// loopwarden alarms: the running daemon's alarms, and an operator's hand on them.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "model/monitor/alarm_kind.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

struct Options {
  std::string socket;
  bool json = false;
  bool all = false;
  std::string loop;
  std::string alarm;
  std::string reason;
  std::uint64_t minutes = 60;
  std::size_t lines = 50;
};

std::string utc(std::int64_t ms) {
  if (ms <= 0) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(static_cast<std::time_t>(ms / 1000)));
}

std::string describe(const json& alarm, std::int64_t now_ms) {
  std::string text = alarm.at("state").get<std::string>();
  if (text == "shelved") {
    const std::int64_t left_ms = alarm.at("shelved_until_ms").get<std::int64_t>() - now_ms;
    text += fmt::format(", {} min left", (left_ms + 59'999) / 60'000);
  }
  if (alarm.at("consequence").get<bool>()) text += ", consequence of low_air_supply";
  return text;
}

// null is what the daemon says of a size that is not known.
std::string size_text(const json& size, const char* not_known) {
  return size.is_number() ? fmt::format("{:.1f} %", size.get<double>()) : not_known;
}

void print_table(const json& answer, bool all) {
  const auto now_ms = answer.at("now_ms").get<std::int64_t>();
  std::size_t shown = 0;
  for (const json& alarm : answer.at("alarms")) {
    const std::string state = alarm.at("state").get<std::string>();
    const bool quiet =
        (state == "normal" || state == "suppressed") && !alarm.at("active").get<bool>();
    if (quiet && !all) continue;
    if (shown++ == 0) {
      fmt::print("{:<14} {:<15} {:<10} {:<20} {:>5}  {}\n", "LOOP", "ALARM", "SEVERITY",
                 "RAISED (UTC)", "TIMES", "STATE");
    }
    fmt::print("{:<14} {:<15} {:>10} {:<20} {:>5}  {}\n", alarm.at("loop").get<std::string>(),
               alarm.at("alarm").get<std::string>(), size_text(alarm.at("severity_percent"), "-"),
               utc(alarm.at("raised_ms").get<std::int64_t>()),
               alarm.at("times_raised").get<std::uint64_t>(), describe(alarm, now_ms));
  }
  if (shown == 0) fmt::print("no alarms\n");
  if (!all) fmt::print("{}", suppressed_note(answer));
}

std::vector<std::string> alarm_names() {
  std::vector<std::string> names;
  for (const monitor::AlarmKind kind : monitor::kAlarmKinds) names.emplace_back(to_text(kind));
  return names;
}

// What is wrong with an alarm's name; empty: nothing.
std::string no_alarm(const std::string& word) {
  const std::vector<std::string> names = alarm_names();
  if (std::find(names.begin(), names.end(), word) != names.end()) return {};
  return fmt::format("no alarm is called '{}'{}", config::quotable(word),
                     config::suggestion(word, names));
}

int run_list(const Options& options) {
  DaemonClient daemon(options.socket);
  const json answer = daemon.alarms();
  options.json ? show_json(answer) : print_table(answer, options.all);
  return kExitOk;
}

int run_action(const Options& options, const char* action) {
  DaemonClient daemon(options.socket);
  loop_index(daemon.status(), options.loop);
  json order = {{"alarm", options.alarm}, {"action", action}};
  if (std::string(action) == "shelve") order["minutes"] = options.minutes;
  if (!options.reason.empty()) order["reason"] = options.reason;
  const json answer = daemon.act(options.loop, order);
  if (options.json) {
    show_json(answer);
  } else {
    fmt::print("{} of {}: {}{}\n", options.alarm, options.loop,
               answer.at("alarm").at("state").get<std::string>(),
               answer.at("on_disk").get<bool>()
                   ? ""
                   : "; the journal can't write: a restart may not remember it");
  }
  return kExitOk;
}

int run_veto(const Options& options, bool veto) {
  DaemonClient daemon(options.socket);
  loop_index(daemon.status(), options.loop);
  const json answer = daemon.veto(options.loop, veto, options.reason);
  if (options.json) {
    show_json(answer);
  } else {
    fmt::print("corrective action of {}: {}{}\n", options.loop, veto ? "vetoed" : "allowed",
               answer.at("on_disk").get<bool>() ? "" : "; the journal can't write");
  }
  return kExitOk;
}

std::string journal_line(const json& line) {
  std::string text = utc(line.at("utc_ms").get<std::int64_t>()) + "  ";
  const auto part = [&](const char* key) { return line.at(key).get<std::string>(); };
  if (!part("loop").empty()) text += part("loop") + " ";
  if (!part("alarm").empty()) text += part("alarm") + " ";
  if (!part("from").empty()) text += part("from") + " -> " + part("to") + " ";
  if (line.at("severity_percent").is_number()) {
    text += fmt::format("{:.1f} % ", line.at("severity_percent").get<double>());
  }
  if (!part("what").empty()) text += part("what") + " ";
  if (!part("new").empty()) {
    text += part("old").empty() ? part("new") + " " : part("old") + " -> " + part("new") + " ";
  }
  if (!part("peer").empty()) text += "by " + part("peer") + " ";
  if (!part("reason").empty()) text += "(" + part("reason") + ") ";
  if (!part("result").empty() && part("result") != "done") text += part("result");
  return text;
}

void print_explanation(const json& e) {
  fmt::print("why ({} UTC, the newest minutes against the twin): {}\n",
             utc(e.at("ended_ms").get<std::int64_t>()), e.at("sentence").get<std::string>());
  if (!e.at("final_name").is_null()) {
    fmt::print("  first named {}, explained as {}\n", e.at("alarm").get<std::string>(),
               e.at("final_name").get<std::string>());
  } else if (!e.at("effect").get<std::string>().empty() && !e.at("agrees").get<bool>()) {
    fmt::print("  this does not agree with the alarm, and is not sure enough to take its name\n");
  }
  const auto size = [&](const char* key) { return size_text(e.at(key), "-"); };
  if (e.at("size_percent").is_number()) {
    fmt::print("  size {} of the CO span ({} to {})\n", size("size_percent"), size("low_percent"),
               size("high_percent"));
  }
  if (e.at("gap_closed").is_number()) {
    fmt::print("  closes {:.0f} % of the gap on minutes that it was not fitted to\n",
               100.0 * e.at("gap_closed").get<double>());
  }
  if (e.at("since_s").is_number() && e.at("since_s").get<double>() > 0.0) {
    fmt::print("  since {:.0f} min before the alarm, or earlier\n",
               e.at("since_s").get<double>() / 60.0);
  }
  std::string others;
  for (const json& name : e.at("alternatives")) {
    others += (others.empty() ? "" : ", ") + name.get<std::string>();
  }
  if (!others.empty()) fmt::print("  as right: {}\n", others);
  if (!e.at("remedy").get<std::string>().empty()) {
    fmt::print("  what to do: {}\n", e.at("remedy").get<std::string>());
  }
  // What nothing explains may have no report.
  fmt::print("  {}{}\n\n", e.at("folder").get<std::string>(),
             e.at("verdict") == "not_explained" ? "" : "/report.html");
}

bool is_process_alarm(const std::string& name) {
  return std::any_of(monitor::kProcessAlarms.begin(), monitor::kProcessAlarms.end(),
                     [&](monitor::AlarmKind kind) { return name == to_text(kind); });
}

void print_guide(const json& answer) {
  fmt::print("\nwhat it is:     {}\nwhat it leads to: {}\nwhat to do:     {}\n\n",
             answer.at("cause").get<std::string>(), answer.at("consequence").get<std::string>(),
             answer.at("action").get<std::string>());
}

// A process alarm has neither size nor window, nor evidence: its reasons stand in the journal.
void print_process_alarm(const Options& options, const json& answer) {
  const json& alarm = answer.at("alarm");
  fmt::print("{} of {}: {}, raised {} UTC\n", options.alarm, options.loop,
             alarm.at("state").get<std::string>(), utc(alarm.at("raised_ms").get<std::int64_t>()));
  print_guide(answer);
  if (!answer.value("disk_answers", true)) {
    fmt::print("the disk does not answer: the history can't be read\n");
  }
  for (const json& line : answer.at("history")) fmt::print("{}\n", journal_line(line));
}

int run_explain(const Options& options) {
  DaemonClient daemon(options.socket);
  loop_index(daemon.status(), options.loop);
  const json answer = daemon.explain(options.loop, options.alarm);
  if (options.json) {
    show_json(answer);
    return kExitOk;
  }
  if (is_process_alarm(options.alarm)) {
    print_process_alarm(options, answer);
    return kExitOk;
  }
  const json& alarm = answer.at("alarm");
  const json& m = answer.at("monitor");
  const std::string size = alarm.at("severity_percent").is_number()
                               ? fmt::format("{} of the CO span (worst {})",
                                             size_text(alarm.at("severity_percent"), "-"),
                                             size_text(alarm.at("worst_severity_percent"), "-"))
                               : "size not known";
  fmt::print("{} of {}: {}, {}, raised {} UTC\n", options.alarm, options.loop,
             alarm.at("state").get<std::string>(), size,
             utc(alarm.at("raised_ms").get<std::int64_t>()));
  if (alarm.at("consequence").get<bool>()) fmt::print("explained by low_air_supply\n");
  print_guide(answer);
  if (!answer.at("explanation").is_null()) print_explanation(answer.at("explanation"));
  fmt::print("newest window ({}): ", m.at("window_state").get<std::string>());
  std::string separator;
  for (const auto& [name, p] : m.at("probability").items()) {
    fmt::print("{}{} {:.2f}", separator, name, p.get<double>());
    separator = ", ";
  }
  fmt::print(
      "\noscillation index {:.2f}, period {:.1f} s; variability {:.2f} % of PV span; {:.1f} % of "
      "the time saturated\ntravel {:.0f} % of CO span/h, {:.0f} reversals/h; stick {}\n\n",
      m.value("oscillation_index", 0.0), m.value("oscillation_period_s", 0.0),
      m.value("variability_percent", 0.0), m.value("saturated_percent", 0.0),
      m.value("travel_percent_per_hour", 0.0), m.value("reversals_per_hour", 0.0),
      m.at("stick_percent").is_number()
          ? fmt::format("{:.2f} % of CO span (from {})", m.at("stick_percent").get<double>(),
                        m.value("stick_source", ""))
          : std::string("not measured"));
  if (answer.at("evidence").is_string()) {
    const auto folder = answer.at("evidence").get<std::string>();
    fmt::print(
        "evidence: {}\nthe samples that raised it, judged once more: loopwarden replay {}\n\n",
        folder, folder);
  } else {
    fmt::print("{}\n\n", answer.value("disk_answers", true)
                             ? "evidence: none on the disk"
                             : "the disk does not answer: evidence and history can't be read");
  }
  for (const json& line : answer.at("history")) fmt::print("{}\n", journal_line(line));
  return kExitOk;
}

int run_journal(const Options& options) {
  DaemonClient daemon(options.socket);
  const json status = daemon.status();
  if (!options.loop.empty()) loop_index(status, options.loop);
  // Lines that don't reach the disk are not among those that are read from it.
  for (const std::string& trouble : disk_troubles(status)) {
    fmt::print(stderr, "loopwarden: {}\n", trouble);
  }
  const json lines = daemon.journal(options.lines, options.loop);
  if (options.json) {
    show_json(lines);
    return kExitOk;
  }
  // The newest last, as in a log.
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    fmt::print("{}\n", journal_line(*line));
  }
  return kExitOk;
}

}  // namespace

void add_alarms(Program& program) {
  const auto made =
      program.command("alarms", "a running daemon's alarms: list, ack, shelve, explain", run_list);
  Command command = made.command;
  Options& o = made.options;
  command.socket(o.socket);
  command.flag("--json", o.json, "print JSON");
  command.flag("--all", o.all, "list those that are off, too");
  command.footer(
      // One line, which the completion of the shell reads.
      fmt::format("Alarms: {}.\n", fmt::join(alarm_names(), ", ")) +
      "Example: loopwarden alarms shelve FIC-101 stiction --minutes 120 --reason \"packing "
      "ordered\"");

  const auto action = [&](const char* name, const char* wire, const char* meaning) {
    const bool explains = std::string(wire) == "explain";
    Command verb = command.verb(name, meaning, [&o, wire, explains] {
      return explains ? run_explain(o) : run_action(o, wire);
    });
    verb.required("loop", o.loop, "tag of the loop");
    verb.required("alarm", o.alarm, "name of the alarm", checked(no_alarm));
    if (std::string(wire) == "shelve")
      verb.setting("--minutes", o.minutes, "time on the shelf", between(1, 1440));
    if (!explains) verb.option("--reason", o.reason, "why, for the journal");
  };
  action("ack", "acknowledge", "acknowledge an alarm");
  action("reset", "reset", "reset an alarm that is latched");
  action("shelve", "shelve", "put an alarm aside for a limited time");
  action("unshelve", "unshelve", "take an alarm off the shelf");
  action("explain", "explain", "what an alarm means, what was measured, and its history");

  for (const bool veto : {true, false}) {
    Command verb =
        command.verb(veto ? "veto" : "allow",
                     veto ? "stop a loop's corrective action: the jacket goes back to shadow"
                          : "lift the veto of a loop's corrective action",
                     [&o, veto] { return run_veto(o, veto); });
    verb.required("loop", o.loop, "tag of the loop");
    verb.option("--reason", o.reason, "why, for the journal");
  }

  Command journal =
      command.verb("journal", "the newest lines of the journal", [&o] { return run_journal(o); });
  journal.option("loop", o.loop, "tag of a loop; every loop without it");
  journal.setting("--lines", o.lines, "how many", between(1, 200));
}

}  // namespace loopwarden::workbench
