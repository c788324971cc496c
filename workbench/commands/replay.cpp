// SPDX-License-Identifier: Apache-2.0
// loopwarden replay: runs the daemon's monitor and alarms over a record, faster than real time. It
// can also judge the window that raised an alarm again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/specialists/specialist_folder.hpp"
#include "model/twin/explain.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/records/record_input.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/alarm/loop_incident.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/watch/specialist_judge.hpp"
#include "workbench/commands/replay_evidence.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/text/explanation_json.hpp"
#include "workbench/text/incident_json.hpp"
#include "workbench/text/twin_log.hpp"

namespace loopwarden::workbench {
namespace {

using alarm::AlarmState;
using watch::MonitorStep;

constexpr double kSamePeriod = 0.01;  // relative

struct ReplayOptions {
  RecordInput input;
  std::string record;
  std::string specialists;
  std::string twin;
  bool explain = true;
  unsigned jobs = 0;
  double overlap = 0.5;
  std::vector<double> pv_range{0.0, 100.0};  // range of PV, PV units, without specialists
  std::vector<double> co_range{0.0, 100.0};  // range of CO, CO units, without specialists
  bool json = false;
};

struct TimedTransition {
  double time_s = 0.0;
  alarm::AlarmTransition transition;
  std::optional<nlohmann::json> explanation{};   // where the alarm was raised, with a twin
  std::optional<alarm::AlarmKind> first_name{};  // where the explanation changed it
};

struct ToldIncident {
  alarm::Incident incident;
  nlohmann::json explanation = nullptr;  // the newest; null: no explanation
};

struct Replay {
  std::vector<TimedTransition> transitions;
  std::vector<ToldIncident> incidents;
  std::size_t windows = 0;
  std::size_t suppressed = 0;
  std::size_t routine_windows = 0;  // minutes or hours that were judged
  nlohmann::json twin{};            // results in addition to its alarm; null: no twin
};

// Returns whether the journal has a line for this. Changes between normal and suppressed have no
// line.
bool worth_a_line(const alarm::AlarmTransition& t) {
  const auto quiet = [](AlarmState s) {
    return s == AlarmState::normal || s == AlarmState::suppressed;
  };
  return !(quiet(t.from) && quiet(t.to));
}

watch::WindowSettings settings_of(const record::Record& record, const ReplayOptions& options,
                                  const specialist::Team* team) {
  constexpr double kSample = 0.1;  // s, as the daemon cuts a loop without specialists
  const double sample_s = team != nullptr ? team->facts.period_s : kSample;
  const auto decimation = std::max<long>(1, std::lround(sample_s / record.period_s));
  watch::WindowSettings settings{.overlap = options.overlap,
                                 .decimation = static_cast<std::size_t>(decimation),
                                 .sample_time_s = record.period_s,
                                 .pv_low = options.pv_range[0],
                                 .pv_high = options.pv_range[1],
                                 .co_low = options.co_range[0],
                                 .co_high = options.co_range[1]};
  if (team != nullptr) {
    settings.pv_low = team->facts.pv_low;
    settings.pv_high = team->facts.pv_high;
    settings.co_low = team->facts.co_low;
    settings.co_high = team->facts.co_high;
  }
  return settings;
}

// Explains alarms when they are raised. Alarms of the same stretch share one explanation.
class Explainer {
 public:
  Explainer(const record::Record& record, const plant::LoopModel& twin, unsigned jobs)
      : record_{record.period_s, record.pv, record.sp, record.co},
        first_s_(record.time_s.front()),
        twin_(twin),
        jobs_(threads(jobs)) {}

  const twin::Explanation& at(std::size_t sample) {
    if (!newest_ || sample >= newest_->stretch.end) {
      newest_ = twin::explain(record_, twin_, sample, {}, on_threads(jobs_));
    }
    return *newest_;
  }

  nlohmann::json json(const twin::Explanation& e, alarm::AlarmKind alarm) const {
    return explanation_json(e, alarm, first_s_, record_.period_s);
  }

 private:
  numeric::LoopRecord record_;
  double first_s_;
  const plant::LoopModel& twin_;
  unsigned jobs_;
  std::optional<twin::Explanation> newest_;
};

// Runs the monitor and the alarms over a record. If `team` is null, only routine evidence is used.
// `twin` may be null.
class Replayer {
 public:
  Replayer(const record::Record& record, const specialist::Team* team, const plant::LoopModel* twin,
           const ReplayOptions& options)
      : record_(record),
        judge_(team != nullptr ? std::optional<watch::SpecialistJudge>(std::in_place, *team)
                               : std::nullopt),
        loop_(settings_of(record, options, team), alarm::kAlarmRule, judge_ ? &*judge_ : nullptr,
              twin) {
    if (twin != nullptr && options.explain) explainer_.emplace(record, *twin, options.jobs);
  }

  Replay run() {
    for (std::size_t k = 0; k < record_.size(); ++k) {
      // A cycle without PV and CO counts as missing, as in the daemon.
      if (std::isfinite(record_.pv[k]) || std::isfinite(record_.co[k])) cycle(k);
    }
    if (loop_.twin() != nullptr) result_.twin = twin_log_.json(loop_);
    return std::move(result_);
  }

 private:
  void cycle(std::size_t k) {
    const MonitorStep step =
        loop_.add({.period_index = k,
                   .sp = !record_.sp.empty() ? record_.sp[k] : record_.pv[k],
                   .pv = record_.pv[k],
                   .co = record_.co[k],
                   .stem = !record_.stem.empty() ? record_.stem[k] : std::nan(""),
                   .automatic = true,
                   .pv_good = std::isfinite(record_.pv[k])});
    if (loop_.twin() != nullptr) twin_log_.add(loop_, record_.time_s[k]);
    const auto now_ms = static_cast<std::int64_t>(std::llround(1000.0 * record_.time_s[k]));
    switch (step.kind) {
      case MonitorStep::Kind::nothing: break;
      case MonitorStep::Kind::interrupted: keep(k, alarms_.window_not_valid()); break;
      case MonitorStep::Kind::not_fit:
        ++result_.windows;
        ++result_.suppressed;
        keep(k, alarms_.window_not_valid());
        break;
      case MonitorStep::Kind::judged:
        ++result_.windows;
        stick_seen_ =
            alarm::shows_stick(step.measures) || (stick_seen_ && incident_.incident().open());
        keep(k, alarms_.window_judged(now_ms, step.conditions));
        break;
    }
    if (step.routine) {
      ++result_.routine_windows;
      keep(k, alarms_.judged(now_ms, step.conditions, alarm::AlarmReason::routine));
    }
    if (step.twin) keep(k, alarms_.judged(now_ms, step.conditions, alarm::AlarmReason::twin));
  }

  // Updates the incident. Changes occur only when a window is judged, so time advances then.
  void follow(std::int64_t now_ms) {
    for (const alarm::IncidentChange& change : incident_.follow(now_ms, alarms_)) {
      if (change.kind == alarm::IncidentChange::Kind::opened) result_.incidents.emplace_back();
    }
    if (!result_.incidents.empty()) result_.incidents.back().incident = incident_.incident();
  }

  void explain_incident(std::int64_t now_ms, alarm::AlarmKind alarm, const twin::Explanation& e,
                        const nlohmann::json& told) {
    alarm::IncidentExplanation says{.alarm = alarm, .raised_ms = now_ms};
    if (e.usable()) {
      says.from_ms = std::llround(1000.0 * record_.time_s[e.at]);
      if (!e.result.effects.empty()) {
        const gap::FoundEffect& first = e.result.effects.front();
        says.effect = first.spec.name;
        says.block = first.block;
        says.confidence = first.confidence;
        says.gap_closed = e.closed;
        says.stick_seen = stick_seen_;
      }
    }
    incident_.explained(now_ms, says);
    result_.incidents.back().explanation = told;
  }

  void keep(std::size_t k, const alarm::AlarmTransitions& changed) {
    const auto now_ms = static_cast<std::int64_t>(std::llround(1000.0 * record_.time_s[k]));
    follow(now_ms);
    tell(k, now_ms, changed);
    follow(now_ms);
  }

  void tell(std::size_t k, std::int64_t now_ms, const alarm::AlarmTransitions& changed) {
    for (const alarm::AlarmTransition& t : changed.view()) {
      if (!worth_a_line(t)) continue;
      TimedTransition line{record_.time_s[k], t};
      if (!explainer_ || t.to != AlarmState::unacknowledged) {
        result_.transitions.push_back(std::move(line));
        continue;
      }
      const twin::Explanation& e = explainer_->at(k);
      const std::optional<alarm::AlarmKind> found = twin::final_name(e, t.kind);
      const bool named = found && !alarm::refuted(e.result.effects.front().spec.name, stick_seen_);
      const alarm::AlarmKind name = named ? found.value_or(t.kind) : t.kind;
      line.explanation = explainer_->json(e, name);
      explain_incident(now_ms, t.kind, e, *line.explanation);
      if (!named) {
        result_.transitions.push_back(std::move(line));
        continue;
      }
      // Reports the alarm only under its final name, and only if that alarm was not on already.
      const double size = twin::size_percent(e);
      for (const alarm::AlarmTransition& then :
           alarms_.explained(now_ms, t.kind, name, size).view()) {
        if (then.kind != name || !worth_a_line(then)) continue;
        TimedTransition final_line = line;
        final_line.transition = then;
        final_line.first_name = t.kind;
        result_.transitions.push_back(std::move(final_line));
      }
    }
  }

  const record::Record& record_;
  std::optional<watch::SpecialistJudge> judge_;
  watch::LoopMonitor loop_;
  alarm::LoopAlarms alarms_{alarm::AlarmSettings{}};
  alarm::LoopIncident incident_;
  bool stick_seen_ = false;  // by the read-back, since the incident opened
  std::optional<Explainer> explainer_;
  TwinLog twin_log_;
  Replay result_;
};

nlohmann::json incidents_json(const Replay& result, const std::string& tag) {
  nlohmann::json incidents = nlohmann::json::array();
  for (const ToldIncident& told : result.incidents) {
    incidents.push_back(incident_json(told.incident, tag));
    incidents.back()["explanation"] = told.explanation;
  }
  return incidents;
}

void print_json(const Replay& result, const std::string& tag) {
  const bool with_twin = !result.twin.is_null();
  nlohmann::json transitions = nlohmann::json::array();
  for (const TimedTransition& line : result.transitions) {
    const alarm::AlarmTransition& t = line.transition;
    nlohmann::json one = {
        {"time_s", line.time_s},
        {"alarm", to_text(t.kind)},
        {"from", to_text(t.from)},
        {"to", to_text(t.to)},
        {"severity_percent",
         alarm::has_size(t.kind) ? nlohmann::json(t.severity_percent) : nlohmann::json(nullptr)},
        {"reason", to_text(t.reason)}};
    if (with_twin) one["explanation"] = line.explanation ? *line.explanation : nlohmann::json();
    if (line.first_name) one["first_name"] = to_text(*line.first_name);
    transitions.push_back(std::move(one));
  }
  show_json(nlohmann::json{{"transitions", std::move(transitions)},
                           {"incidents", incidents_json(result, tag)},
                           {"windows", result.windows},
                           {"suppressed_windows", result.suppressed},
                           {"routine_windows", result.routine_windows},
                           {"twin", result.twin}});
}

void print_text(const Replay& result, const std::string& tag) {
  if (!result.transitions.empty()) {
    fmt::print("{:>10}  {:<15} {:<24} {:<24} {:>8}  {}\n", "time s", "alarm", "from", "to",
               "severity", "by");
  }
  for (const TimedTransition& line : result.transitions) {
    const alarm::AlarmTransition& t = line.transition;
    fmt::print("{:10.1f}  {:<15} {:<24} {:<24} {:>8}  {}\n", line.time_s, to_text(t.kind),
               to_text(t.from), to_text(t.to),
               alarm::has_size(t.kind) ? fmt::format("{:.1f} %", t.severity_percent) : "-",
               to_text(t.reason));
    if (line.first_name) fmt::print("{:12}first named {}\n", "", to_text(*line.first_name));
    if (line.explanation) {
      const nlohmann::json& e = *line.explanation;
      fmt::print("{:12}{} to {} s against the twin: {}\n", "", e.at("from_s").dump(),
                 e.at("to_s").dump(), e.at("sentence").get<std::string>());
    }
  }
  for (const nlohmann::json& incident : incidents_json(result, tag)) {
    fmt::print("{}\n", incident_text(incident));
  }
  fmt::print(
      "{} alarm transition{}. Specialists: {} of {} window{} judged, the others cannot be judged. "
      "Routine evidence: {} longer window{} judged.\n",
      result.transitions.size(), result.transitions.size() == 1 ? "" : "s",
      result.windows - result.suppressed, result.windows, result.windows == 1 ? "" : "s",
      result.routine_windows, result.routine_windows == 1 ? "" : "s");
}

int run_replay(const ReplayOptions& options) {
  if (std::filesystem::is_directory(options.record)) {
    return replay_evidence(options.record, options.json);
  }
  for (const std::vector<double>* range : {&options.pv_range, &options.co_range}) {
    if (!((*range)[0] < (*range)[1])) {
      fail(kExitUsage, "a range needs a lower and an upper end, as 0 100");
    }
  }
  std::optional<plant::LoopModel> twin;
  if (!options.twin.empty()) twin = load_model(options.twin);
  std::optional<config::SpecialistFolder> folder;
  if (!options.specialists.empty()) {
    folder = usable(config::read_specialists(options.specialists));
    if (!folder->team) {
      fail(kExitConfiguration, "{}: no specialists of the explaining form", options.specialists);
    }
  }
  try {
    const record::Record record = options.input.read(options.record).record;
    if (record.co.empty()) {
      fail(kExitData, "{}: no column 'co', which a judgement of the valve needs", options.record);
    }
    if (folder) {
      const double sample_s = folder->team->facts.period_s;
      const double cycles = std::max(1.0, std::round(sample_s / record.period_s));
      if (std::abs(cycles * record.period_s - sample_s) > kSamePeriod * sample_s) {
        fail(kExitData,
             "{}: its period is {:g} s, of which no whole number makes the {:g} s that the "
             "specialists know",
             options.record, record.period_s, sample_s);
      }
    }
    if (twin && std::abs(twin->sample_time_s - record.period_s) > kSamePeriod * record.period_s) {
      fail(kExitData, "{}: its period is {:g} s, the twin's sample_time {:g} s", options.record,
           record.period_s, twin->sample_time_s);
    }
    const Replay result =
        Replayer(record, folder ? &*folder->team : nullptr, twin ? &*twin : nullptr, options).run();
    const std::string tag = std::filesystem::path(options.record).stem().string();
    options.json ? print_json(result, tag) : print_text(result, tag);
  } catch (const effects::EffectError& e) {
    fail(kExitConfiguration, "{}: {}", options.twin, e.what());
  }
  return kExitOk;
}

}  // namespace

void add_replay(Program& program) {
  auto [command, o] =
      program.command("replay", "Run the daemon's monitor and alarms over a record", run_replay);
  command.required(
      "record", o.record,
      "record, CSV: time, pv, co, and if known sp, stem; or the folder of an alarm's evidence");
  command.option("--specialists", o.specialists,
                 "folder with manifest.yaml; evidence has its own. Without it only routine "
                 "evidence is used");
  command.option(
      "--twin", o.twin,
      "twin.yaml of `loopwarden commission`: adds the alarm model_gap and an explanation "
      "of every alarm");
  command.flag("!--no-explain", o.explain, "do not explain the alarms");
  command.setting("--jobs", o.jobs, "threads of the explanations; 0: one per core");
  command.option("--pv-range", o.pv_range, "range of PV, PV units, without specialists").takes(2);
  command.option("--co-range", o.co_range, "range of CO, CO units, without specialists").takes(2);
  command.setting("--overlap", o.overlap, "overlap of neighbouring windows, share",
                  between(0.0, 0.95));
  command.flag("--json", o.json, "print the transitions as JSON");
  o.input.add_options(command);
  command.footer(
      "A row without pv and co is a missing cycle; a row with co but without pv is a bad PV.\n"
      "Of evidence: exit code 0 if the verdict is the same, 65 if it is not.\n"
      "Example: loopwarden replay run.csv --specialists examples/specialists/plant1 --json");
}

}  // namespace loopwarden::workbench
