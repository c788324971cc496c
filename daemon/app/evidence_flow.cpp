// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/evidence_flow.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/clock.hpp"
#include "config/loop_model_writer.hpp"
#include "daemon/app/attempt.hpp"
#include "daemon/explain/explanation_file.hpp"
#include "daemon/explain/pending_explanation.hpp"
#include "model/twin/explain.hpp"

namespace loopwarden::daemon {
namespace {

// A lasting incident is explained again when this much time since the change has been seen.
constexpr std::array kAgain_s{0.5 * twin::kMostSeen_s, twin::kMostSeen_s};

// Time between two searches for the move of a slip.
constexpr double kSearch_s = 60.0;

// Returns the next of these times after `explained_s`: the last one that has passed, otherwise the
// first one to come. 0: none remains.
double next_of(double explained_s, double seen_s) {
  double next_s = 0.0;
  for (const double again_s : kAgain_s) {
    if (again_s > explained_s && (next_s == 0.0 || again_s <= seen_s)) next_s = again_s;
  }
  return next_s;
}

std::map<std::string, config::SpecialistFolder> contents_of(
    const config::Specialists& specialists) {
  std::map<std::string, config::SpecialistFolder> contents;
  for (const auto& [name, folder] : specialists.folders) contents.emplace(name, folder.content);
  return contents;
}

// Converts a time of the loops to real time.
std::chrono::milliseconds wall_clock(double loop_s, double accelerate) {
  return std::chrono::milliseconds(std::llround(1000.0 * loop_s / accelerate));
}

journal::JournalEntry evidence_line(std::string result) {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::system;
  line.utc_ms = base::utc_ms();
  line.what = "evidence";
  line.result = std::move(result);
  return line;
}

}  // namespace

EvidenceFlow::EvidenceFlow(const config::DaemonConfig& config,
                           const config::Specialists& specialists, Dependencies dependencies)
    : deps_(std::move(dependencies)),
      accelerate_(config.accelerate),
      state_directory_(config.state_directory),
      store_folder_(state_directory_ / "evidence"),
      store_(
          {.folder = store_folder_, .most_kept = config.alarms.most_evidence},
          contents_of(specialists),
          [this](const evidence::Evidence& e, const std::filesystem::path& folder,
                 const std::string& why) { report_evidence(e, folder, why); },
          [this](const std::string& why) { report_removal(why); }),
      explainer_(
          {.program = deps_.explain, .save = wall_clock(60.0, accelerate_), .spare = deps_.spare},
          [this](std::size_t loop) { return deps_.history(loop)->minutes(); },
          [this](const ExplainJob& job, const Explanation* explanation, const std::string& why) {
            report_explanation(job, explanation, why);
          }) {
  for (const auto& [name, folder] : specialists.folders) specialist_hashes_[name] = folder.hash;
  for (const auto& [name, twin] : specialists.twins) twins_[name] = config::write_model(twin, name);
}

std::string EvidenceFlow::twin(std::size_t loop) const {
  const auto found = twins_.find(deps_.loops[loop].config.monitor.twin);
  return found == twins_.end() ? std::string() : found->second;
}

void EvidenceFlow::start() {
  store_.start();
  explainer_.start();
}

void EvidenceFlow::keep(std::size_t loop, alarm::AlarmKind alarm,
                        const watch::LoopMonitor& loop_monitor, const watch::MonitorStep& step,
                        alarm::AlarmReason reason) {
  const config::LoopConfig& config = deps_.loops[loop].config;
  const supervision::History* const history = deps_.history(loop);
  evidence::Evidence evidence;
  evidence.loop = config.name;
  evidence.elsewhere = config::is_watched(config.io);
  evidence.alarm = alarm;
  const supervision::AlarmSnapshot watch = deps_.alarms.snapshot(loop);
  evidence.raised_ms = watch.alarms.alarm(alarm).memory().raised_ms;
  if (watch.incident.incident().open()) {
    evidence.incident_ms = watch.incident.incident().opened_ms;
  }
  if (reason == alarm::AlarmReason::twin) {
    evidence.take(loop_monitor, history->minutes());
  } else {
    evidence.take(loop_monitor, step, reason);
  }
  evidence.version = LOOPWARDEN_VERSION;
  evidence.config_hash = deps_.config_hash();
  evidence.loop_file = config.file;
  if (history != nullptr) {
    evidence.raised_at = history->newest();
    evidence.twin = twins_.at(config.monitor.twin);
  }
  if (evidence.by_specialists()) {
    evidence.specialists_folder = config.monitor.specialists;
    evidence.specialists_hash = specialist_hashes_[config.monitor.specialists];
  }
  store_.post(std::move(evidence));
}

void EvidenceFlow::report_evidence(const evidence::Evidence& evidence,
                                   const std::filesystem::path& folder, const std::string& why) {
  journal::JournalEntry line = evidence_line(why.empty() ? "done" : "not written: " + why);
  line.loop = evidence.loop;
  line.alarm = alarm::to_text(evidence.alarm);
  line.new_value = folder.string();
  deps_.journal.post(std::move(line));
  // A later alarm of an incident is explained together with the first one.
  const bool first = folder.parent_path() == store_folder_;
  if (why.empty() && first && !evidence.twin.empty()) have_explained(evidence, folder);
}

void EvidenceFlow::report_removal(const std::string& why) {
  deps_.journal.post(evidence_line("old evidence is not removed: " + why));
}

void EvidenceFlow::have_explained(const evidence::Evidence& evidence,
                                  const std::filesystem::path& folder) {
  const std::size_t loop = find_loop(deps_.loops, evidence.loop).value();
  const supervision::History& history = *deps_.history(loop);
  // The minutes before the alarm may be too few for an explanation. Then it waits for minutes after
  // the alarm.
  const double unquiet_s = history.unquiet_s();
  const double wait_s = unquiet_s > 0.0 ? std::max(0.0, twin::kEnough_s - unquiet_s) : 0.0;
  const double since_s = static_cast<double>(history.newest() - evidence.raised_at) *
                         deps_.loops[loop].config.sample_time_s;
  explainer_.post({.loop = loop,
                   .alarm = evidence.alarm,
                   .raised_at = evidence.raised_at,
                   .raised_ms = evidence.raised_ms,
                   .incident_ms = evidence.incident_ms,
                   .folder = folder,
                   .wait = wall_clock(wait_s, accelerate_),
                   .enough_s = since_s + wait_s,
                   .seen_s = unquiet_s + wait_s,
                   .changed_at = cycle_before(loop, unquiet_s)});
}

void EvidenceFlow::report_explanation(const ExplainJob& job, const Explanation* explanation,
                                      const std::string& why) {
  if (job.is_search()) return report_search(job, explanation, why);
  if (explanation != nullptr) {
    deps_.alarms.of(job.loop).explained(with_slip(*explanation, job.loop));
    search_move(job.loop, *explanation, {});
  } else if (!job.repeat) {  // else the one before it stands
    tell_not_explained(job, why);
  }
  explain_again(job);
}

Explanation EvidenceFlow::with_slip(Explanation explanation, std::size_t loop) const {
  if (!explanation.slip) return explanation;
  const TestSlip& slip = *explanation.slip;
  const bool watched =
      deps_.loops[loop].config.recording.enabled || slip.state != TestSlip::State::open;
  if (!slip.another_move.empty()) explanation.next_test += " " + slip.another_move;
  explanation.next_test +=
      " Slip: " + (watched ? to_text(slip) : "open: without recording the move is not seen") + ".";
  return explanation;
}

void EvidenceFlow::search_move(std::size_t loop, const Explanation& explanation,
                               const std::string& trouble) {
  const config::LoopConfig& config = deps_.loops[loop].config;
  if (!explanation.slip || explanation.slip->state != TestSlip::State::open ||
      !config.recording.enabled) {
    return;
  }
  const std::filesystem::path folder = explanation.folder;
  explainer_.post({.loop = loop,
                   .alarm = explanation.alarm,
                   .raised_ms = explanation.raised_ms,
                   .folder = folder,
                   .wait = wall_clock(kSearch_s, accelerate_),
                   .repeat = true,
                   .wanted =
                       [this, loop, folder] {
                         const auto newest = deps_.alarms.snapshot(loop).explanation;
                         return newest && newest->folder == folder &&
                                std::filesystem::exists(folder);
                       },
                   .segments = state_directory_ / "segments" / config.name,
                   .trouble = trouble});
}

void EvidenceFlow::report_search(const ExplainJob& job, const Explanation* explanation,
                                 const std::string& why) {
  const auto shown = deps_.alarms.snapshot(job.loop).explanation;
  if (!shown || shown->folder != job.folder || !shown->slip) return;
  if (explanation == nullptr) {
    if (why != job.trouble) {
      spdlog::warn("{}: the move of the slip is not searched: {}", deps_.alarms.name(job.loop),
                   why);
    }
    return search_move(job.loop, *shown, why);
  }
  if (!explanation->slip) return;
  Explanation now = *shown;  // its name may differ from the file
  now.slip = explanation->slip;
  now.next_test = with_slip(*explanation, job.loop).next_test;
  if (now.next_test != shown->next_test) {
    deps_.alarms.of(job.loop).restore(now);
    journal_slip(job, *now.slip, *shown->slip);
  }
  search_move(job.loop, now, {});
}

void EvidenceFlow::journal_slip(const ExplainJob& job, const TestSlip& slip,
                                const TestSlip& before) {
  journal::JournalEntry line;
  if (slip.state == TestSlip::State::done) {
    journal::set_test_result(line, slip.competing, slip.predicted, slip.decided, slip.probability);
  } else {
    line.kind = journal::JournalEntry::Kind::test;
    line.what = "test";
    line.new_value = slip.state == before.state ? "another move" : "expired";
    line.reason = slip.state == before.state ? slip.another_move : std::string();
  }
  line.utc_ms = base::utc_ms();
  line.loop = deps_.alarms.name(job.loop);
  line.alarm = alarm::to_text(job.alarm);
  line.result = "done";
  deps_.journal.post(std::move(line));
}

void EvidenceFlow::tell_not_explained(const ExplainJob& job, const std::string& why) {
  Explanation none;
  none.alarm = job.alarm;
  none.raised_ms = job.raised_ms;
  none.ended_ms = base::utc_ms();
  none.verdict = kNotExplained;
  none.sentence = "Not explained: " + why + ".";
  none.folder = job.folder;
  attempt("explanation", [&] { write_not_explained(none); });
  deps_.alarms.of(job.loop).explained(none);
}

bool EvidenceFlow::lasts(const ExplainJob& job) const {
  const supervision::AlarmSnapshot watch = deps_.alarms.snapshot(job.loop);
  const alarm::Incident& incident = watch.incident.incident();
  return incident.open() && incident.gone_ms == 0 && incident.opened_ms == job.incident_ms;
}

void EvidenceFlow::explain_again(const ExplainJob& job) {
  const supervision::History& history = *deps_.history(job.loop);
  const double period_s = deps_.loops[job.loop].config.sample_time_s;
  const double seen_s =
      period_s * static_cast<double>(static_cast<std::int64_t>(history.newest()) - job.changed_at);
  const double next_s = next_of(job.seen_s, seen_s);
  if (next_s == 0.0 || !lasts(job)) return;
  ExplainJob next = job;
  next.repeat = true;
  // The saved minutes from before the restart are explained. Repeats use the minutes after it.
  next.renewed = job.renewed || job.resumed_s;
  next.resumed_s.reset();
  const double there_s = next.renewed ? history.unquiet_s() : twin::kEnough_s;
  next.seen_s = next_s;
  next.wait = wall_clock(std::max({0.0, next_s - seen_s, twin::kEnough_s - there_s}), accelerate_);
  next.wanted = [this, next] { return lasts(next); };
  explainer_.post(std::move(next));
}

void EvidenceFlow::go_on(std::size_t loop, const Explanation& newest) {
  const supervision::AlarmSnapshot watch = deps_.alarms.snapshot(loop);
  const alarm::Incident& incident = watch.incident.incident();
  if (deps_.history(loop) == nullptr || !incident.covers(newest.raised_ms, deps_.alarms.now_ms()) ||
      newest.folder.parent_path() != store_folder_) {
    return;
  }
  const double before_s = std::isfinite(newest.since_s) ? std::max(0.0, newest.since_s) : 0.0;
  explain_again({.loop = loop,
                 .alarm = newest.alarm,
                 .raised_ms = newest.raised_ms,
                 .incident_ms = incident.opened_ms,
                 .folder = newest.folder,
                 .renewed = true,
                 .seen_s = before_s + since_s(newest.raised_ms, newest.ended_ms),
                 .changed_at = cycle_before(
                     loop, before_s + since_s(newest.raised_ms, deps_.alarms.now_ms()))});
}

double EvidenceFlow::since_s(std::int64_t from_ms, std::int64_t to_ms) const {
  // 0 if the clock was set back in between.
  return accelerate_ * 1e-3 * static_cast<double>(std::max<std::int64_t>(to_ms - from_ms, 0));
}

std::int64_t EvidenceFlow::cycle_before(std::size_t loop, double s) const {
  return static_cast<std::int64_t>(deps_.history(loop)->newest()) -
         std::llround(s / deps_.loops[loop].config.sample_time_s);
}

void EvidenceFlow::remember() {
  for (std::size_t i = 0; i < deps_.loops.size(); ++i) {
    std::vector<Explanation> known;
    for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
      const supervision::AlarmSnapshot watch = deps_.alarms.snapshot(i);
      const bool active = watch.alarms.alarm(kind).active();
      const bool of_incident =
          watch.incident.incident().open() && watch.incident.incident().has(kind);
      if (!active && !of_incident) continue;
      const auto folder = store_.newest(deps_.alarms.name(i), kind);
      if (!folder) continue;
      if (std::filesystem::exists(*folder / "explanation.json")) {
        attempt("explanation", [&] { known.push_back(read_explanation(*folder)); });
      } else if (active && deps_.history(i) != nullptr && folder->parent_path() == store_folder_) {
        resume_explanation(i, kind, *folder);
      }
    }
    // Sorts the newest explanation to the end.
    std::sort(known.begin(), known.end(),
              [](const auto& a, const auto& b) { return a.ended_ms < b.ended_ms; });
    for (const Explanation& explanation : known) {
      deps_.alarms.of(i).restore(with_slip(explanation, i));
    }
    if (known.empty()) continue;
    go_on(i, known.back());
    search_move(i, known.back(), {});
  }
}

// Queues an alarm whose explanation was pending when the daemon ended. If no minutes were saved,
// the samples of its evidence are used.
void EvidenceFlow::resume_explanation(std::size_t loop, alarm::AlarmKind alarm,
                                      const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "twin.yaml")) return;
  const PendingExplanation pending =
      read_pending(folder).value_or(PendingExplanation{.enough_s = twin::kEnough_s});
  spdlog::info("loop {}: alarm {} is explained now: the restart came before",
               deps_.alarms.name(loop), alarm::to_text(alarm));
  const supervision::AlarmSnapshot watch = deps_.alarms.snapshot(loop);
  const std::int64_t raised_ms = watch.alarms.alarm(alarm).memory().raised_ms;
  explainer_.post({.loop = loop,
                   .alarm = alarm,
                   .raised_ms = raised_ms,
                   .incident_ms = watch.incident.incident().opened_ms,
                   .folder = folder,
                   .enough_s = pending.enough_s,
                   .resumed_s = pending.there_s,
                   .again = wall_clock(twin::kEnough_s, accelerate_),
                   .seen_s = twin::kEnough_s,
                   .changed_at = cycle_before(loop, since_s(raised_ms, deps_.alarms.now_ms()))});
}

}  // namespace loopwarden::daemon
