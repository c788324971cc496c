// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/evidence_flow.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/clock.hpp"
#include "config/loop_model_writer.hpp"
#include "daemon/app/attempt.hpp"
#include "daemon/explain/explanation_file.hpp"
#include "daemon/explain/pending_explanation.hpp"
#include "model/commission/explain.hpp"

namespace loopwarden::daemon {
namespace {

std::map<std::string, config::SpecialistFolder> contents_of(const Specialists& specialists) {
  std::map<std::string, config::SpecialistFolder> contents;
  for (const auto& [name, folder] : specialists.folders) contents.emplace(name, folder.content);
  return contents;
}

// How long it takes until so much of the loops' time has passed.
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

EvidenceFlow::EvidenceFlow(const config::DaemonConfig& config, const Specialists& specialists,
                           Ends ends)
    : ends_(std::move(ends)),
      accelerate_(config.accelerate),
      store_folder_(std::filesystem::path(config.state_directory) / "evidence"),
      store_(
          {.folder = store_folder_, .most_kept = config.alarms.most_evidence},
          contents_of(specialists),
          [this](const evidence::Evidence& e, const std::filesystem::path& folder,
                 const std::string& why) { report_evidence(e, folder, why); },
          [this](const std::string& why) { report_removal(why); }),
      explainer_(
          {.program = workbench_program(),
           .save = wall_clock(60.0, accelerate_),
           .spare = ends_.spare},
          [this](std::size_t loop) { return ends_.history(loop)->minutes(); },
          [this](const ExplainJob& job, const Explanation* explanation, const std::string& why) {
            report_explanation(job, explanation, why);
          }) {
  for (const auto& [name, folder] : specialists.folders) specialist_hashes_[name] = folder.hash;
  for (const auto& [name, twin] : specialists.twins) twins_[name] = config::write_model(twin, name);
}

void EvidenceFlow::start() {
  store_.start();
  explainer_.start();
}

void EvidenceFlow::keep(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                        const loopwarden::monitor::LoopMonitor& loop_monitor,
                        const loopwarden::monitor::MonitorStep& step,
                        loopwarden::monitor::AlarmReason reason) {
  const config::LoopConfig& config = ends_.loops[loop].config;
  const monitor::History* const history = ends_.history(loop);
  evidence::Evidence evidence;
  evidence.loop = config.name;
  evidence.elsewhere = config::is_watched(config.io);
  evidence.alarm = alarm;
  const monitor::LoopWatch watch = ends_.board.watch(loop);
  evidence.raised_ms = watch.alarms.alarm(alarm).memory().raised_ms;
  if (watch.incident.incident().open()) {
    evidence.incident_ms = watch.incident.incident().opened_ms;
  }
  if (reason == loopwarden::monitor::AlarmReason::twin) {
    monitor::History::Minutes minutes = history->minutes();
    evidence.take(loop_monitor, std::move(minutes.sp), std::move(minutes.pv),
                  std::move(minutes.co));
  } else {
    evidence.take(loop_monitor, step, reason);
  }
  evidence.version = LOOPWARDEN_VERSION;
  evidence.config_hash = ends_.config_hash();
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
  line.alarm = loopwarden::monitor::to_text(evidence.alarm);
  line.new_value = folder.string();
  ends_.journal.post(std::move(line));
  // What joins an incident is explained with it.
  const bool first = folder.parent_path() == store_folder_;
  if (why.empty() && first && !evidence.twin.empty()) have_explained(evidence, folder);
}

void EvidenceFlow::report_removal(const std::string& why) {
  ends_.journal.post(evidence_line("old evidence is not removed: " + why));
}

void EvidenceFlow::have_explained(const evidence::Evidence& evidence,
                                  const std::filesystem::path& folder) {
  const std::size_t loop = find_loop(ends_.loops, evidence.loop).value();
  const monitor::History& history = *ends_.history(loop);
  // What came before the alarm may be too little to tell: then the minutes behind it are waited for.
  const double unquiet_s = history.unquiet_s();
  const double wait_s = unquiet_s > 0.0 ? std::max(0.0, commission::kEnough_s - unquiet_s) : 0.0;
  const double since_s = static_cast<double>(history.newest() - evidence.raised_at) *
                         ends_.loops[loop].config.sample_time_s;
  explainer_.post({.loop = loop,
                   .alarm = evidence.alarm,
                   .raised_at = evidence.raised_at,
                   .raised_ms = evidence.raised_ms,
                   .folder = folder,
                   .wait = wall_clock(wait_s, accelerate_),
                   .enough_s = since_s + wait_s,
                   .seen_s = std::max(unquiet_s, commission::kEnough_s)});
}

void EvidenceFlow::report_explanation(const ExplainJob& job, const Explanation* explanation,
                                      const std::string& why) {
  if (explanation != nullptr) {
    ends_.board.explained(job.loop, *explanation);
    explain_again(job);
    return;
  }
  if (job.repeat) return;  // the one before it stands
  Explanation none;
  none.alarm = job.alarm;
  none.raised_ms = job.raised_ms;
  none.ended_ms = base::utc_ms();
  none.verdict = kNotExplained;
  none.sentence = "Not explained: " + why + ".";
  none.folder = job.folder;
  attempt("explanation", [&] { write_not_explained(none); });
  ends_.board.explained(job.loop, none);
}

bool EvidenceFlow::lasts(std::size_t loop) const {
  const monitor::LoopWatch watch = ends_.board.watch(loop);
  return watch.incident.incident().open() && watch.incident.incident().gone_ms == 0;
}

void EvidenceFlow::explain_again(const ExplainJob& job) {
  if (job.resumed_s || 2.0 * job.seen_s > commission::kMostSeen_s || !lasts(job.loop)) return;
  ExplainJob next = job;
  next.repeat = true;
  next.seen_s = 2.0 * job.seen_s;
  next.enough_s = job.enough_s + job.seen_s;
  next.wait = wall_clock(job.seen_s, accelerate_);
  next.wanted = [this, loop = job.loop] { return lasts(loop); };
  explainer_.post(std::move(next));
}

void EvidenceFlow::remember() {
  for (std::size_t i = 0; i < ends_.loops.size(); ++i) {
    std::vector<Explanation> known;
    for (const loopwarden::monitor::AlarmKind kind : loopwarden::monitor::kValveAlarms) {
      const monitor::LoopWatch watch = ends_.board.watch(i);
      const bool active = watch.alarms.alarm(kind).active();
      const bool of_incident =
          watch.incident.incident().open() && watch.incident.incident().has(kind);
      if (!active && !of_incident) continue;
      const auto folder = store_.newest(ends_.board.name(i), kind);
      if (!folder) continue;
      if (std::filesystem::exists(*folder / "explanation.json")) {
        attempt("explanation", [&] { known.push_back(read_explanation(*folder)); });
      } else if (active && ends_.history(i) != nullptr && folder->parent_path() == store_folder_) {
        resume_explanation(i, kind, *folder);
      }
    }
    // The newest last.
    std::sort(known.begin(), known.end(),
              [](const auto& a, const auto& b) { return a.ended_ms < b.ended_ms; });
    for (const Explanation& explanation : known) ends_.board.restore(i, explanation);
  }
}

// Of an alarm that the daemon did not come to explain before it ended. Where no minutes were saved, the samples of its
// evidence are what there is.
void EvidenceFlow::resume_explanation(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                                      const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "twin.yaml")) return;
  const PendingExplanation pending =
      read_pending(folder).value_or(PendingExplanation{.enough_s = commission::kEnough_s});
  spdlog::info("loop {}: alarm {} is explained now: the restart came before",
               ends_.board.name(loop), loopwarden::monitor::to_text(alarm));
  explainer_.post({.loop = loop,
                   .alarm = alarm,
                   .raised_ms = ends_.board.watch(loop).alarms.alarm(alarm).memory().raised_ms,
                   .folder = folder,
                   .enough_s = pending.enough_s,
                   .resumed_s = pending.there_s,
                   .again = wall_clock(commission::kEnough_s, accelerate_)});
}

}  // namespace loopwarden::daemon
