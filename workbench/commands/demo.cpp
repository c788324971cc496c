// SPDX-License-Identifier: Apache-2.0
// loopwarden demo: runs the demonstration of ./demo on a daemon with examples/demo. The set
// point moves, the valve begins to stick, planned moves reduce the cycling, and a table shows the
// result.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>
#include <span>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/child_process.hpp"
#include "model/analysis/loop_metrics.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/demo_test.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench {
namespace {

struct DemoOptions {
  std::string socket;
  std::string loop = "FIC-101";
  std::string page;  // address of the page, without a trailing slash; empty: no page
  std::string worn;  // model of the loop whose explanations a test decides; empty: not shown
  bool open_page = false;
  bool keep = false;
  bool json = false;
};

// A phase of the demonstration, in seconds of the simulated plant.
struct Phase {
  const char* name;   // in the table; empty: not measured
  const char* story;  // what the viewer sees
  double lasts_s;
  double settles_s = 0.0;                       // of it, not measured
  std::optional<protocol::SetRequest> order{};  // at its start, without the loop
  bool worth_a_look = false;                    // the page is opened at its start, if at all
  bool until_calm = false;                      // it ends when planned moves act
};

// The times match the fault schedule of examples/demo/models/plant1-sticking.yaml.
std::vector<Phase> phases() {
  return {
      {.name = "",
       .story = "Plant 1 at rest on 3 L/min; the loop is in automatic.",
       .lasts_s = 10.0,
       .order = {{.mode = "auto"}}},
      {.name = "healthy valve",
       .story = "Set point to 5 L/min: a healthy valve follows.",
       .lasts_s = 130.0,
       .settles_s = 80.0,
       .order = {{.set_point = 5.0}}},
      {.name = "", .story = "The packing tightens: stiction grows.", .lasts_s = 120.0},
      {.name = "",
       .story = "Set point to 6 L/min: the valve sticks, then jumps.",
       .lasts_s = 100.0,
       .order = {{.set_point = 6.0}},
       .worth_a_look = true},
      {.name = "sticking", .story = "Limit cycle: CO a saw-tooth, PV square.", .lasts_s = 500.0},
      {.name = "",
       .story = "The twin explains the alarm. Planned moves run in shadow mode to measure their "
                "benefit.",
       .lasts_s = 3600.0,
       .until_calm = true},
      {.name = "planned moves",
       .story = "Same valve, same tuning, with planned moves.",
       .lasts_s = 1000.0,
       .settles_s = 100.0},
  };
}

struct Measured {
  std::string name;
  analysis::LoopMetrics metrics;
};

class Demo {
 public:
  explicit Demo(const DemoOptions& options)
      : daemon_(options.socket),
        trend_(options.loop),
        loop_(options.loop),
        json_(options.json),
        open_page_(options.open_page) {
    if (!options.page.empty()) page_ = fmt::format("{}/#/loop/{}", options.page, options.loop);
    if (is_terminal(STDOUT_FILENO) && is_terminal(STDIN_FILENO) && !options.json) {
      screen_.emplace();
    }
  }

  // Returns false if the viewer left before the end, or the loop left automatic.
  bool run() {
    record_ = protocol::ask(daemon_, protocol::RecordRequest{.loop = loop_, .start = "demo"}).file;
    for (const Phase& phase : phases()) {
      if (phase.order) {
        protocol::SetRequest order = *phase.order;
        order.loop = loop_;
        daemon_.set(order);
      }
      if (!screen_) say(fmt::format("{:6.0f} s  {}", now_s(), phase.story));
      if (phase.worth_a_look) open_page();
      const double began_s = now_s();
      if (!play(phase, began_s)) return false;
      left_automatic_ = !in_automatic();
      if (left_automatic_) return false;
      if (phase.until_calm && !acts_) {
        say("The alarm was not explained in time, because this computer is busy.");
        break;
      }
      if (*phase.name != '\0') measured_.push_back(measure(phase, began_s));
    }
    record_ = protocol::ask(daemon_, protocol::RecordRequest{.loop = loop_, .stop = true}).file;
    return true;
  }

  // If the computer is too slow, late cycles are a fault and the daemon puts the loop in manual.
  // The figures are meaningless then.
  bool left_automatic() const { return left_automatic_; }

  void keep_running() {
    while (!interrupted() && draw("The daemon runs on; Ctrl-C or q ends it.")) {
    }
  }

  void leave_screen() { screen_.reset(); }

  // Explanations run at idle priority, and the first ones take longer.
  void wait_for_explanations() {
    constexpr std::chrono::seconds kPatience{120};
    const auto begin = std::chrono::steady_clock::now();
    const auto waiting = [this] { return status().daemon.explanations.waiting; };
    if (waiting() == 0) return;
    say("Waiting for the explanation of the alarms ...");
    while (waiting() > 0 && !interrupted() &&
           std::chrono::steady_clock::now() - begin < kPatience) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
    watch_alarms();
  }

  void print_table() const {
    fmt::print("\n{}\n", coloured("Results of the record", Colour::bold));
    fmt::print("{:<18} {:>12} {:>12} {:>12} {:>10} {:>12} {:>12}\n", "", "rms SP-PV", "mean SP-PV",
               "PV swing +-", "period", "stem travel", "reversals");
    fmt::print("{:<18} {:>12} {:>12} {:>12} {:>10} {:>12} {:>12}\n", "", "L/min", "L/min", "L/min",
               "s", "V/h", "1/h");
    for (const Measured& m : measured_) {
      fmt::print("{:<18} {:>12.3f} {:>12.3f} {:>12.3f} {:>10} {:>12.1f} {:>12.0f}\n", m.name,
                 m.metrics.rms_error, m.metrics.mean_error, m.metrics.amplitude,
                 m.metrics.period_s > 0.0 ? fmt::format("{:.1f}", m.metrics.period_s) : "-",
                 m.metrics.travel_per_hour, m.metrics.reversals_per_hour);
    }
    fmt::print("\nRecord: {}\n", record_);
  }

  void print_json() const {
    nlohmann::json phases = nlohmann::json::array();
    for (const Measured& m : measured_) {
      phases.push_back({{"phase", m.name},
                        {"rms_error", m.metrics.rms_error},
                        {"mean_error", m.metrics.mean_error},
                        {"amplitude", m.metrics.amplitude},
                        {"period_s", m.metrics.period_s},
                        {"travel_per_hour", m.metrics.travel_per_hour},
                        {"reversals_per_hour", m.metrics.reversals_per_hour}});
    }
    const nlohmann::json result = {
        {"loop", loop_}, {"phases", std::move(phases)}, {"alarms", alarms_}, {"record", record_}};
    show_json(result);
  }

  void print_alarms() {
    fmt::print("\n{}\n", coloured("Messages to the operator", Colour::bold));
    for (const std::string& line : alarms_) fmt::print("{}\n", line);
    if (alarms_.empty()) {
      fmt::print(
          "No alarms. {} cycles were late on this computer, and a window allows only a few.\n",
          status().daemon.skipped_ticks);
    }
    if (misses_many_cycles()) {
      fmt::print(
          "This computer is too busy for the demonstration: {} cycles were missed. The figures are "
          "not valid. Repeat it when the computer is idle.\n",
          status().daemon.skipped_ticks);
      return;
    }
    const protocol::LoopAnswer loop = protocol::ask(daemon_, protocol::LoopRequest{loop_});
    if (!loop.status.incident || active_.empty()) return;
    const protocol::Incident& incident = *loop.status.incident;
    fmt::print("All of it is one incident: {} ({}), raised by {}.\n", incident.name, incident.cause,
               fmt::join(incident.alarms, ", "));
    const std::string& telling =
        active_.count(incident.name) != 0 ? incident.name : *active_.begin();
    const protocol::Explained explained =
        protocol::ask(daemon_, protocol::ExplainRequest{.loop = loop_, .alarm = telling});
    fmt::print("The valve still has {}{}: {}.\n{}.\n", telling,
               acts_ ? ", although the loop is compensated" : "", explained.cause,
               explained.action);
    if (loop.explanation) {
      fmt::print("Explanation by the twin: {}\nThe picture: {}/report.html\n",
                 loop.explanation->sentence, loop.explanation->folder);
    }
    if (explained.evidence) {
      fmt::print("To judge the window that raised it again: loopwarden replay {}\n",
                 *explained.evidence);
    }
  }

 private:
  protocol::Status status() { return protocol::ask(daemon_, protocol::StatusRequest{}); }

  // Explanations of a record with as many gaps are not true.
  bool misses_many_cycles() {
    constexpr double kMostMissed = 0.01;  // of the cycles
    const protocol::DaemonStatus now = status().daemon;
    return static_cast<double>(now.skipped_ticks) > kMostMissed * static_cast<double>(now.ticks);
  }

  // With --json, standard output carries only the result.
  void say(const std::string& line) const {
    fmt::print(json_ ? stderr : stdout, "{}\n", line);
    std::fflush(stdout);
  }

  // Opens the page in the browser of this desktop. Without one, the printed address is enough.
  void open_page() {
    if (page_.empty()) return;
    if (!screen_) say(fmt::format("          in a browser: {}", page_));
    if (!open_page_ || (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY"))) return;
    const int nowhere =
        ::open("/dev/null", O_WRONLY | O_CLOEXEC);  // its words would tear the screen
    try {
      browser_.emplace("/usr/bin/xdg-open", std::vector<std::string>{page_},
                       base::ChildSettings{.output = nowhere, .idle = false});
    } catch (const std::system_error&) {
      open_page_ = false;  // no such program
    }
    ::close(nowhere);
  }

  double now_s() {
    const auto& rows = trend_.rows();
    return rows.period.empty() ? 0.0 : static_cast<double>(rows.period.back()) * rows.sample_time_s;
  }

  bool in_automatic() {
    const std::vector<protocol::LoopStatus> loops = status().loops;
    return std::any_of(loops.begin(), loops.end(), [&](const protocol::LoopStatus& loop) {
      return loop.name == loop_ && loop.cycle && loop.cycle->mode == "AUTO";
    });
  }

  // Collects the messages to the operator in order.
  void watch_alarms() {
    for (const protocol::Alarm& alarm : protocol::ask(daemon_, protocol::AlarmsRequest{}).alarms) {
      if (alarm.loop != loop_ || alarm.active == (active_.count(alarm.alarm) != 0)) continue;
      if (alarm.active) {
        active_.insert(alarm.alarm);
        const double size = alarm.severity_percent;
        alarms_.push_back(fmt::format("{:6.0f} s  ALARM  {}: {}", now_s(), alarm.alarm,
                                      std::isfinite(size)
                                          ? fmt::format("{:.1f} % of the output's span", size)
                                          : "size not known"));
      } else {
        active_.erase(alarm.alarm);
        alarms_.push_back(fmt::format("{:6.0f} s  gone   {}", now_s(), alarm.alarm));
      }
      if (!screen_) say(alarms_.back());
    }
  }

  // Collects the steps of corrective action from the journal.
  void watch_steps() {
    const protocol::Journal journal =
        protocol::ask(daemon_, protocol::JournalRequest{.loop = loop_, .most = 50});
    for (auto line = journal.lines.rbegin(); line != journal.lines.rend(); ++line) {
      if (line->id <= newest_line_) continue;
      newest_line_ = line->id;
      if (line->what.rfind("planned moves", 0) != 0 && line->what != "corrective action") continue;
      acts_ = line->what == "planned moves on" && line->result == "done";
      alarms_.push_back(fmt::format("{:6.0f} s  {}: {}", now_s(), line->what, line->reason));
      if (!screen_) say(alarms_.back());
    }
  }

  bool play(const Phase& phase, double began_s) {
    while (now_s() < began_s + phase.lasts_s && !(phase.until_calm && acts_)) {
      if (interrupted() || !draw(phase.story)) return false;
    }
    return true;
  }

  // Draws one picture; returns false when the viewer pressed q.
  bool draw(const std::string& story) {
    trend_.update(daemon_);
    watch_alarms();
    watch_steps();
    if (!screen_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return true;
    }
    const protocol::Status now = status();
    const std::size_t loop = loop_index(now.loops, loop_);
    const TerminalSize size = terminal_size();
    std::string text = coloured(daemon_line(now), Colour::grey) + "\n\n";
    for (const std::string& line : loop_table(now.loops, loop)) text += line + "\n";
    text += "\n" + coloured(fmt::format("  {:4.0f} s  {}", now_s(), story), Colour::bold) + "\n\n";
    if (!page_.empty()) text += fmt::format("  in a browser: {}\n\n", page_);
    if (!alarms_.empty()) text += coloured(alarms_.back(), Colour::red) + "\n\n";
    for (const std::string& line : trend_view(now.loops[loop], trend_.rows(), 300.0, size.columns,
                                              size.rows - (page_.empty() ? 11 : 13))) {
      text += line + "\n";
    }
    screen_->show(text);
    return screen_->key(std::chrono::milliseconds(100)).value_or(' ') != 'q';
  }

  Measured measure(const Phase& phase, double began_s) const {
    const protocol::Trend& t = trend_.rows();
    const auto index_of = [&](double time_s) {
      const auto period = static_cast<std::uint64_t>(time_s / t.sample_time_s);
      return static_cast<std::size_t>(std::lower_bound(t.period.begin(), t.period.end(), period) -
                                      t.period.begin());
    };
    const std::size_t first = index_of(began_s + phase.settles_s);
    const std::size_t count = index_of(began_s + phase.lasts_s) - first;
    const auto part = [&](const std::vector<double>& values) {
      return std::span<const double>(values).subspan(first, count);
    };
    // The stem of a healthy valve follows the noise of CO. Moves below 0.2 % of span do not count.
    constexpr double kStemResolution = 0.02;  // V
    return {phase.name, analysis::loop_metrics(part(t.sp), part(t.pv), part(t.stem),
                                               t.sample_time_s, kStemResolution)};
  }

  DaemonClient daemon_;
  TrendBuffer trend_;
  std::string loop_;
  bool json_;
  bool open_page_;
  std::string page_;  // the loop's view; empty: there is no page
  std::optional<base::ChildProcess> browser_;
  std::string record_;
  std::vector<Measured> measured_;
  std::set<std::string> active_;     // alarms
  std::vector<std::string> alarms_;  // messages about alarms, and actions
  std::int64_t newest_line_ = 0;     // of the journal
  bool acts_ = false;                // planned moves do
  bool left_automatic_ = false;
  std::optional<Screen> screen_;
};

int run_demo(const DemoOptions& options) {
  use_colours(is_terminal(STDOUT_FILENO));
  watch_interrupts();
  Demo demo(options);
  const bool complete = demo.run();
  if (complete && options.keep) demo.keep_running();
  demo.leave_screen();
  if (complete) demo.wait_for_explanations();
  if (demo.left_automatic()) {
    fmt::print(stderr,
               "The loop left automatic, because this computer is too busy for the demonstration. "
               "Try again when it is idle.\n");
  }
  if (!complete) return kExitTryAgain;
  if (options.json) {
    demo.print_json();
    return kExitOk;
  }
  demo.print_table();
  demo.print_alarms();
  if (!options.worn.empty()) {
    fmt::print("\n{}\n", coloured("A test decides between two explanations", Colour::bold));
    show_test_scene(options.worn, [](const std::string& line) {
      fmt::print("{}\n", line);
      std::fflush(stdout);
    });
  }
  return kExitOk;
}

}  // namespace

void add_demo(Program& program) {
  auto [command, o] = program.command("demo", "Run the demonstration of ./demo", run_demo);
  command.socket(o.socket);
  command.setting("--loop", o.loop, "tag of the demonstrated loop");
  const Option page =
      command.option("--page", o.page, "address of a loopwarden-page that shows this daemon");
  command.flag("--open", o.open_page, "open it when the valve begins to stick").needs(page);
  command.option("--worn", o.worn, "model of a second loop, whose record two explanations fit");
  command.flag("--keep", o.keep, "continue to watch until q is pressed");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: ./demo (starts the daemon, then this)");
}

}  // namespace loopwarden::workbench
