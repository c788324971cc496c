// SPDX-License-Identifier: Apache-2.0
// loopwarden alarms: shows the running daemon's alarms and sends an operator's commands to them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/box_alarms.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/alarm_book.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct Options {
  std::string socket;
  bool json = false;
  bool all = false;
  std::string loop;
  std::string alarm;
  std::string reason;
  std::uint64_t minutes = 60;
  std::uint64_t hours = 24;
  bool rationalised = false;
  std::size_t lines = 50;
};

std::string describe(const protocol::Alarm& alarm, std::int64_t now_ms) {
  std::string text = alarm.state;
  if (text == "shelved") {
    const std::int64_t left_ms = alarm.shelved_until_ms - now_ms;
    text += fmt::format(", {} min left", (left_ms + 59'999) / 60'000);
  }
  if (alarm.consequence) text += ", consequence of " + alarm.consequence_of;
  if (alarm.first_out) text += ", first out";
  if (alarm.flaps > 1) text += fmt::format(", flaps: {} times", alarm.flaps);
  if (!alarm.about.empty()) text += ", " + alarm.about;
  return text;
}

std::string size_text(double percent) {
  return std::isfinite(percent) ? fmt::format("{:.1f} %", percent) : std::string("-");
}

// Word of `ack` that selects all alarms of a loop's incident.
constexpr const char* kIncident = "incident";

void print_incidents(const std::vector<protocol::Incident>& incidents, bool all) {
  std::size_t shown = 0;
  for (const protocol::Incident& incident : incidents) {
    if (!incident.active && !incident.unacknowledged && !all) continue;
    if (shown++ == 0) {
      fmt::print("{:<14} {:<24} {:<12} {:<20} {:<15} {}\n", "LOOP", "INCIDENT", "CAUSE",
                 "RAISED (UTC)", "STATE", "ALARMS");
    }
    const char* state = incident.unacknowledged             ? "unacknowledged"
                        : incident.active                   ? "acknowledged"
                        : std::isfinite(incident.cleared_s) ? "ended"
                                                            : "gone";
    fmt::print("{:<14} {:<24} {:<12} {:<20} {:<15} {}\n", incident.loop, incident.name,
               incident.cause, utc_text(static_cast<std::int64_t>(1000.0 * incident.raised_s)),
               state, fmt::join(incident.alarms, ", "));
  }
  if (shown > 0) fmt::print("\n");
}

void print_table(const protocol::Alarms& answer, bool all) {
  print_incidents(answer.incidents, all);
  std::size_t shown = 0;
  for (const protocol::Alarm& alarm : answer.alarms) {
    const bool quiet = (alarm.state == "normal" || alarm.state == "suppressed") && !alarm.active;
    if (quiet && !all) continue;
    if (shown++ == 0) {
      fmt::print("{:<14} {:<15} {:<8} {:<10} {:<20} {:>5}  {}\n", "LOOP", "ALARM", "PRIORITY",
                 "SEVERITY", "RAISED (UTC)", "TIMES", "STATE");
    }
    fmt::print("{:<14} {:<15} {:<8} {:>10} {:<20} {:>5}  {}\n", alarm.loop, alarm.alarm,
               alarm.priority, size_text(alarm.severity_percent), utc_text(alarm.raised_ms),
               alarm.times_raised, describe(alarm, answer.now_ms));
  }
  if (shown == 0) fmt::print("no alarms\n");
  if (!all) fmt::print("{}", suppressed_note(answer.alarms));
}

std::vector<std::string> alarm_names() {
  std::vector<std::string> names;
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) names.emplace_back(to_text(kind));
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) names.emplace_back(to_text(kind));
  return names;
}

// Returns the error of an alarm's name; empty: the name is valid.
std::string no_alarm(const std::string& word) {
  const std::vector<std::string> names = alarm_names();
  if (std::find(names.begin(), names.end(), word) != names.end()) return {};
  return fmt::format("no alarm is called '{}'{}", config::quotable(word),
                     config::suggestion(word, names));
}

// Throws DaemonRefused if the daemon has no such loop.
void check_loop(DaemonClient& daemon, const std::string& loop) {
  if (loop == alarm::kBox) return;
  loop_index(protocol::ask(daemon, protocol::StatusRequest{}).loops, loop);
}

protocol::Maybe<std::string> reason_of(const Options& options) {
  return options.reason.empty() ? protocol::Maybe<std::string>{} : options.reason;
}

int run_list(const Options& options) {
  DaemonClient daemon(options.socket);
  const auto answer = protocol::ask(daemon, protocol::AlarmsRequest{});
  options.json ? show_answer(answer) : print_table(answer, options.all);
  return kExitOk;
}

int run_rationalised(const Options& options) {
  DaemonClient daemon(options.socket);
  const auto answer = protocol::ask(daemon, protocol::AlarmDesignRequest{});
  options.json ? show_answer(answer) : fmt::print("{}", rationalised_csv(answer));
  return kExitOk;
}

int run_figures(const Options& options) {
  DaemonClient daemon(options.socket);
  const auto answer = protocol::ask(daemon, protocol::AlarmFiguresRequest{.hours = options.hours});
  options.json ? show_answer(answer) : fmt::print("{}", figures_text(answer));
  return kExitOk;
}

int acknowledge_incident(DaemonClient& daemon, const Options& options) {
  const auto status = protocol::ask(daemon, protocol::LoopRequest{options.loop}).status;
  if (!status.incident) fail(kExitData, "{} has had no incident", options.loop);
  const protocol::IncidentActed answer =
      protocol::ask(daemon, protocol::AcknowledgeIncidentRequest{.loop = options.loop,
                                                                 .incident = status.incident->id,
                                                                 .reason = reason_of(options)});
  if (options.json) {
    show_answer(answer);
  } else {
    fmt::print("incident {} ({}): acknowledged{}\n", answer.incident.id, answer.incident.name,
               answer.on_disk ? "" : "; the journal cannot be written, so a restart may lose this");
  }
  return kExitOk;
}

int run_action(const Options& options, const char* action) {
  DaemonClient daemon(options.socket);
  check_loop(daemon, options.loop);
  if (options.alarm == kIncident) return acknowledge_incident(daemon, options);
  protocol::AlarmRequest order{
      .loop = options.loop, .alarm = options.alarm, .action = action, .reason = reason_of(options)};
  if (order.action == "shelve") order.minutes = options.minutes;
  const protocol::AlarmActed answer = protocol::ask(daemon, order);
  if (options.json) {
    show_answer(answer);
  } else {
    fmt::print("{} of {}: {}{}\n", options.alarm, options.loop, answer.alarm.state,
               answer.on_disk ? "" : "; the journal cannot be written, so a restart may lose this");
  }
  return kExitOk;
}

int run_veto(const Options& options, bool veto) {
  DaemonClient daemon(options.socket);
  check_loop(daemon, options.loop);
  const protocol::Vetoed answer = protocol::ask(
      daemon, protocol::VetoRequest{.loop = options.loop, .veto = veto, .reason = options.reason});
  if (options.json) {
    show_answer(answer);
  } else {
    fmt::print("corrective action of {}: {}{}\n", options.loop, veto ? "vetoed" : "allowed",
               answer.on_disk ? "" : "; the journal can't write");
  }
  return kExitOk;
}

std::string journal_line(const protocol::JournalLine& line) {
  std::string text = utc_text(line.utc_ms) + "  ";
  if (!line.loop.empty()) text += line.loop + " ";
  if (!line.alarm.empty()) text += line.alarm + " ";
  if (!line.from.empty()) text += line.from + " -> " + line.to + " ";
  if (std::isfinite(line.severity_percent)) {
    text += fmt::format("{:.1f} % ", line.severity_percent);
  }
  if (!line.what.empty()) text += line.what + " ";
  if (!line.new_.empty()) {
    text += (line.old_.empty() ? line.new_ : line.old_ + " -> " + line.new_) + " ";
  }
  if (!line.peer.empty()) text += "by " + line.peer + " ";
  if (!line.reason.empty()) text += "(" + line.reason + ") ";
  if (!line.result.empty() && line.result != "done") text += line.result;
  return text;
}

// Returns whether the explanation's size and action replace those of the alarm: it agrees with the
// alarm or has renamed it.
bool replaces(const std::optional<protocol::Explanation>& e) {
  return e && (e->agrees || e->final_name);
}

// Returns the one size of an alarm, with its source if it is that of the explanation.
std::string size_of(const protocol::Explained& answer) {
  const protocol::Alarm& alarm = answer.alarm;
  if (const auto& e = answer.explanation; replaces(e) && std::isfinite(e->size_percent)) {
    return fmt::format(
        "{} of the CO span ({} to {}) by the explanation, which replaces the estimate of the "
        "detector, {}",
        size_text(e->size_percent), size_text(e->low_percent), size_text(e->high_percent),
        size_text(alarm.severity_percent));
  }
  if (!std::isfinite(alarm.severity_percent)) return "size not known";
  return fmt::format("{} of the CO span (worst {})", size_text(alarm.severity_percent),
                     size_text(alarm.worst_severity_percent));
}

void print_explanation(const protocol::Explanation& e) {
  fmt::print("why ({} UTC, the newest minutes against the twin): {}\n", utc_text(e.ended_ms),
             e.sentence);
  if (e.final_name) {
    fmt::print("  first named {}, explained as {}\n", e.alarm, *e.final_name);
  } else if (!e.effect.empty() && !e.agrees) {
    fmt::print("  disagrees with the alarm, but is too uncertain to rename it\n");
  }
  if (std::isfinite(e.size_percent) && !replaces(e)) {
    fmt::print("  size {} of the CO span ({} to {})\n", size_text(e.size_percent),
               size_text(e.low_percent), size_text(e.high_percent));
  }
  if (std::isfinite(e.gap_closed)) {
    fmt::print("  closes {:.0f} % of the gap to the twin\n", 100.0 * e.gap_closed);
  }
  if (e.since_s > 0.0) {
    fmt::print("  since {:.0f} min before the alarm, or earlier\n", e.since_s / 60.0);
  }
  if (!e.alternatives.empty()) fmt::print("  as right: {}\n", fmt::join(e.alternatives, ", "));
  if (!e.next_test.empty()) fmt::print("  {}\n", e.next_test);
  // An alarm without an explanation may have no report.
  fmt::print("  {}{}\n\n", e.folder, e.verdict == "not_explained" ? "" : "/report.html");
}

bool is_valve_alarm(const std::string& name) {
  return std::any_of(alarm::kValveAlarms.begin(), alarm::kValveAlarms.end(),
                     [&](alarm::AlarmKind kind) { return name == to_text(kind); });
}

void print_guide(const protocol::Explained& answer) {
  fmt::print(
      "\nCause:        {}\nConsequence:  {}\nAction:       {}\nRespond within: "
      "{}\n\n",
      answer.cause, answer.consequence,
      replaces(answer.explanation) && !answer.explanation->remedy.empty()
          ? answer.explanation->remedy
          : answer.action,
      answer.time_to_act);
}

// Prints an alarm of the loop or the box. It has no size, window or evidence. Its reasons are in
// the journal.
void print_process_alarm(const Options& options, const protocol::Explained& answer) {
  fmt::print("{} of {}: {}, raised {} UTC\n", options.alarm, options.loop, answer.alarm.state,
             utc_text(answer.alarm.raised_ms));
  print_guide(answer);
  if (!answer.disk_answers)
    fmt::print("The disk does not respond. The history is not available.\n");
}

// Prints how to reduce the loop's cycling until the valve is repaired.
void print_calm(DaemonClient& daemon, const Options& options, const protocol::Explained& answer) {
  const std::string& state = answer.monitor.corrective_action;
  const bool sticks = answer.explanation && answer.explanation->effect == "stiction";
  if (state == "off" && sticks) {
    fmt::print(
        "To reduce cycling until the repair, set monitor.corrective_action: {{form: "
        "planned_moves}} in the loop's file.\n\n");
  } else if (state == "offered") {
    fmt::print("To reduce cycling until the repair: loopwarden alarms calm {} stiction{}\n\n",
               options.loop, socket_option(options.socket));
  } else if (state != "off") {
    const protocol::LoopAnswer loop = protocol::ask(daemon, protocol::LoopRequest{options.loop});
    const std::string says = loop.status.cycle ? loop.status.cycle->compensator.says : "";
    fmt::print("corrective action: {}{}{}\n\n", state, says.empty() ? "" : "; ", says);
  }
}

void print_window(const protocol::Monitor& m) {
  fmt::print("newest window ({}): ", m.window_state);
  std::string separator;
  for (const auto& [name, p] : m.probability) {
    fmt::print("{}{} {:.2f}", separator, name, p);
    separator = ", ";
  }
  fmt::print(
      "\noscillation index {:.2f}, period {:.1f} s; variability {:.2f} % of PV span; {:.1f} % of "
      "the time saturated\ntravel {:.0f} % of CO span/h, {:.0f} reversals/h; stick {}\n\n",
      m.oscillation_index, m.oscillation_period_s, m.variability_percent, m.saturated_percent,
      m.travel_percent_per_hour, m.reversals_per_hour,
      std::isfinite(m.stick_percent)
          ? fmt::format("{:.2f} % of CO span (from {})", m.stick_percent, m.stick_source)
          : std::string("not measured"));
}

void print_valve_alarm(DaemonClient& daemon, const Options& options,
                       const protocol::Explained& answer) {
  const protocol::Alarm& alarm = answer.alarm;
  fmt::print("{} of {}: {}, {}, raised {} UTC\n", options.alarm, options.loop, alarm.state,
             size_of(answer), utc_text(alarm.raised_ms));
  if (alarm.consequence) fmt::print("consequence of {}\n", alarm.consequence_of);
  print_guide(answer);
  if (answer.explanation) print_explanation(*answer.explanation);
  if (options.alarm == "stiction") print_calm(daemon, options, answer);
  print_window(answer.monitor);
  if (answer.evidence) {
    fmt::print(
        "evidence: {0}\nTo judge the samples that raised it again: loopwarden replay {0}\n\n",
        *answer.evidence);
  } else {
    fmt::print("{}\n\n",
               answer.disk_answers
                   ? "evidence: none on the disk"
                   : "The disk does not respond. Evidence and history are not available.");
  }
}

int run_explain_alarm(const Options& options) {
  DaemonClient daemon(options.socket);
  check_loop(daemon, options.loop);
  const protocol::Explained answer =
      protocol::ask(daemon, protocol::ExplainRequest{.loop = options.loop, .alarm = options.alarm});
  if (options.json) {
    show_answer(answer);
    return kExitOk;
  }
  is_valve_alarm(options.alarm) ? print_valve_alarm(daemon, options, answer)
                                : print_process_alarm(options, answer);
  for (const protocol::JournalLine& line : answer.history) {
    fmt::print("{}\n", journal_line(line));
  }
  return kExitOk;
}

int run_journal(const Options& options) {
  DaemonClient daemon(options.socket);
  const protocol::Status status = protocol::ask(daemon, protocol::StatusRequest{});
  if (!options.loop.empty()) loop_index(status.loops, options.loop);
  // Lines that don't reach the disk are missing below, because the journal is read from the disk.
  for (const std::string& trouble : disk_troubles(status.daemon)) {
    fmt::print(stderr, "loopwarden: {}\n", trouble);
  }
  protocol::JournalRequest request{.most = options.lines};
  if (!options.loop.empty()) request.loop = options.loop;
  const std::vector<protocol::JournalLine> lines = protocol::ask(daemon, request).lines;
  if (options.json) {
    show_json(lines);
    return kExitOk;
  }
  // The newest line is printed last, as in a log.
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    fmt::print("{}\n", journal_line(*line));
  }
  return kExitOk;
}

}  // namespace

void add_alarms(Program& program) {
  const auto made = program.command(
      "alarms", "List, acknowledge, shelve and explain a running daemon's alarms", run_list);
  Command command = made.command;
  Options& o = made.options;
  command.socket(o.socket);
  command.flag("--json", o.json, "print JSON");
  command.flag("--all", o.all, "list inactive alarms, too");
  command.footer(
      // Prints one line, which the shell completion reads.
      fmt::format("Alarms: {}.\n", fmt::join(alarm_names(), ", ")) +
      "Example: loopwarden alarms shelve FIC-101 stiction --minutes 120 --reason \"packing "
      "ordered\"");

  const auto action = [&](const char* name, const char* wire, const char* meaning) {
    const bool explains = std::string(wire) == "explain";
    Command verb = command.verb(name, meaning, [&o, wire, explains] {
      return explains ? run_explain_alarm(o) : run_action(o, wire);
    });
    verb.required("loop", o.loop, "tag of the loop; box: the edge box");
    const bool takes_incident = std::string(wire) == "acknowledge";
    verb.required("alarm", o.alarm,
                  takes_incident ? "name of the alarm; incident: all alarms of the loop's incident"
                                 : "name of the alarm",
                  checked([takes_incident](const std::string& word) {
                    return takes_incident && word == kIncident ? std::string() : no_alarm(word);
                  }));
    if (std::string(wire) == "shelve")
      verb.setting("--minutes", o.minutes, "duration of the shelving, min", between(1, 1440));
    if (!explains) verb.option("--reason", o.reason, "reason, for the journal");
  };
  action("ack", "acknowledge", "Acknowledge an alarm");
  action("reset", "reset", "Reset an alarm that is latched");
  action("shelve", "shelve", "Shelve an alarm for a limited time");
  action("unshelve", "unshelve", "Unshelve an alarm");
  action("calm", "calm",
         "Start the planned moves that a stiction alarm offers, first in shadow mode");
  action("explain", "explain", "Print an alarm's meaning, its measurements and its history");

  Command list = command.verb("list", "List the alarms, or the design of each",
                              [&o] { return o.rationalised ? run_rationalised(o) : run_list(o); });
  list.flag("--rationalised", o.rationalised,
            "CSV for the plant's own alarm book: limits, delays, cause, consequence, action");
  Command figures = command.verb("figures", "Print alarm figures: rate, floods, chattering, stale",
                                 [&o] { return run_figures(o); });
  figures.setting("--hours", o.hours, "to now", between(1, 720));

  for (const bool veto : {true, false}) {
    Command verb = command.verb(
        veto ? "veto" : "allow",
        veto ? "Stop a loop's corrective action: jacket in shadow mode, planned moves off"
             : "Lift the veto of a loop's corrective action",
        [&o, veto] { return run_veto(o, veto); });
    verb.required("loop", o.loop, "tag of the loop");
    verb.option("--reason", o.reason, "reason, for the journal");
  }

  Command journal = command.verb("journal", "Print the newest lines of the journal",
                                 [&o] { return run_journal(o); });
  journal.option("loop", o.loop, "tag of a loop; default: every loop");
  journal.setting("--lines", o.lines, "how many", between(1, 200));
}

}  // namespace loopwarden::workbench
