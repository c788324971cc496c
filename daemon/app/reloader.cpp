// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reloader.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <exception>
#include <span>
#include <utility>

#include "base/clock.hpp"
#include "base/digest/digest.hpp"

namespace loopwarden::daemon {
namespace {

using reload::LoopPlan;
using Clock = std::chrono::steady_clock;
using State = ReloadJob::State;

constexpr std::chrono::seconds kTakingPatience{2};  // slower loops apply their settings later

std::uint32_t hash_of(const std::string& text) { return base::crc32(text); }

std::string first_error(std::span<const config::Diagnostic> diagnostics) {
  const auto first = std::find_if(
      diagnostics.begin(), diagnostics.end(),
      [](const config::Diagnostic& d) { return d.level == config::Diagnostic::Level::error; });
  return first == diagnostics.end() ? std::string() : config::to_text(*first);
}

bool is_gain(const reload::Change& change) {
  return change.key == "controller.kp" || change.key == "controller.ki" ||
         change.key == "controller.kd";
}

// Returns one line per loop whose user-set gains are in no file and would be replaced by the plan.
std::vector<std::string> gains_lost(const reload::Plan& plan,
                                    const std::vector<LoopRuntime>& loops) {
  std::vector<std::string> lines;
  for (const LoopPlan& planned : plan.loops) {
    std::vector<std::string> changes;
    for (const auto* list : {&planned.keys.applied, &planned.waiting_for_output}) {
      for (const reload::Change& change : *list) {
        if (!is_gain(change)) continue;
        changes.push_back(fmt::format("{} {} -> {}", change.key, change.from, change.to));
      }
    }
    const std::optional<std::size_t> loop = find_loop(loops, planned.loop);
    if (changes.empty() || !loop) continue;
    const auto ordered = loops[*loop].settings->gains_not_in_file();
    if (!ordered || !ordered->author.person) continue;
    lines.push_back(fmt::format(
        "{}: gains in force are not in its file (set by {}, {:%FT%TZ}): {}", planned.loop,
        ordered->author.by, fmt::gmtime(static_cast<std::time_t>(ordered->author.utc_ms / 1000)),
        fmt::join(changes, ", ")));
  }
  return lines;
}

constexpr const char* kTakeFile =
    "gains in force are not in the files; write them there, or take the files' with `loopwarden "
    "reload --take-file`";

// Returns the name of a loop that is being commissioned, as text; empty: none. Its settings must
// not change during a test.
std::string being_commissioned(const std::vector<LoopRuntime>& loops) {
  for (const LoopRuntime& loop : loops) {
    if (const auto holder = loop.commissioning->holder()) {
      return fmt::format("{} is in maintenance by {}", loop.config.name, holder->by);
    }
  }
  return {};
}

std::string what_was_done(const reload::Plan& plan) {
  std::size_t waiting = plan.daemon.waiting_for_restart.size();
  for (const LoopPlan& loop : plan.loops) {
    waiting += loop.keys.waiting_for_restart.size() + loop.waiting_for_output.size();
  }
  if (waiting == 0) return "done";
  return fmt::format("done; {} key{} wait{}", waiting, waiting == 1 ? "" : "s",
                     waiting == 1 ? "s" : "");
}

}  // namespace

Reloader::Reloader(const config::Configuration& started, std::filesystem::path folder,
                   std::vector<LoopRuntime>& loops, const Historian& historian,
                   journal::Journal& journal, ReloaderCallbacks callbacks)
    : running_(started.daemon),
      loops_(loops),
      historian_(historian),
      journal_(journal),
      callbacks_(std::move(callbacks)),
      files_(std::move(folder)),
      offers_(loops, started.loops.size()),
      queue_(journal),
      status_(hash_of(started.text)),
      plan_(reload::at_start(started)) {
  status_.publish(plan_);
}

void Reloader::step() {
  follow_offers();
  if (!current_.job) begin();
  if (!current_.job) return;
  try {
    if (files_.reading()) {
      look_at_files();
    } else {
      finish_taking();
    }
  } catch (const std::exception& e) {
    // An example is lack of memory. During `taking`, the next step reports what the loops have
    // accepted. Before that, the reload has had no effect and is refused, so that its sender does
    // not wait.
    if (current_.job->state == State::taking) throw;
    files_.forget();
    status_.refused(e.what());
    queue_.finish(*current_.job,
                  {.outcome = "refused", .config_hash = config_hash(), .why = e.what()}, 0);
    current_.job = nullptr;
    callbacks_.ready();
    throw;
  }
}

// Resumes the kept reload. A newer waiting reload replaces it, because it reads the present files.
void Reloader::resume_kept() {
  if (!kept_ || !being_commissioned(loops_).empty()) return;
  const ReloadQueue::Kept kept = *std::exchange(kept_, std::nullopt);
  if (!queue_.next()) queue_.again(kept);
}

void Reloader::begin() {
  resume_kept();
  std::shared_ptr<ReloadJob> job = queue_.next();
  if (!job || !files_.begin()) return;
  current_.job = std::move(job);
  queue_.set(*current_.job, State::reading);
  if (current_.job->dry_run) return;
  spdlog::info("reload by {}", current_.job->peer);
  callbacks_.reloading();
}

void Reloader::look_at_files() {
  const std::shared_ptr<const ReadFiles> read = files_.fetch();
  if (!read) return;
  if (read->files) {
    take(*read);
  } else {
    refuse(*read);
  }
}

void Reloader::take(const ReadFiles& read) {
  current_.diagnostics = reload::told(read.files.diagnostics);
  const config::Configuration& wanted = *read.files;
  reload::Plan plan = reload::plan(in_force(), wanted, outputs());
  const std::vector<std::string> lost = gains_lost(plan, loops_);
  const bool refused = !lost.empty() && !current_.job->take_file;
  const std::string who = being_commissioned(loops_);
  std::string not_now = who;
  if (!who.empty()) {
    not_now += current_.job->dry_run ? ": a reload waits until that has ended"
                                     : ": the files are taken when that has ended";
  }
  if (current_.job->dry_run) {
    // A dry run always returns the plan, because the commissioning user checks whether the loop's
    // file is in force.
    std::vector<std::string> lines = reload::to_lines(plan);
    lines.insert(lines.end(), lost.begin(), lost.end());
    if (!not_now.empty()) lines.push_back(not_now);
    protocol::ReloadOutcome outcome{.outcome = plan.all_in_force() ? "in_force" : "waits",
                                    .take_file_needed = refused,
                                    .not_now = !not_now.empty(),
                                    .lines = std::move(lines),
                                    .plan = reload::told(plan)};
    if (refused) outcome.why = kTakeFile;
    if (!not_now.empty()) outcome.why = not_now;
    if (outcome.why) outcome.outcome = "refused";
    finish(std::move(outcome));
    return;
  }
  if (!not_now.empty()) {
    kept_ = {.peer = current_.job->peer, .take_file = current_.job->take_file, .why = who};
    refuse(not_now, {not_now}, {.not_now = true});
    return;
  }
  if (refused) {
    refuse(kTakeFile, lost, {.take_file_needed = true});
    return;
  }
  for (const config::Diagnostic& d : read.files.diagnostics) {
    spdlog::warn("{}", config::to_text(d));
  }
  current_.hash_before = config_hash();
  current_.replaces_gains = !lost.empty();
  current_.taking_since = Clock::now();
  // Steps that may fail are first.
  config::Configuration kept = wanted;
  offers_.make(plan, wanted);
  wanted_ = std::move(kept);
  plan_ = std::move(plan);
  queue_.set(*current_.job, State::taking);
  status_.taken(hash_of(wanted.text));
  note_gains_of_file(wanted);
  reload::apply(wanted.daemon, running_);
  callbacks_.take_over(wanted.daemon);
}

void Reloader::follow_offers() {
  // Whether these settings took effect after their reload was reported as done.
  const bool later = !current_.job || current_.job->state != State::taking;
  const SettingsOffers::Followed followed = offers_.follow(
      plan_, [this](std::size_t loop) { return output(loop); },
      [&](const std::string& loop) {
        if (!later) return;
        spdlog::info("reload: {}: in force now", loop);
        journal::JournalEntry line;
        line.kind = journal::JournalEntry::Kind::system;
        line.utc_ms = base::utc_ms();
        line.loop = loop;
        line.what = "reload";
        line.result = "done: the waiting settings are in force";
        journal_.post(std::move(line));
      });
  if (followed.taken_after) {
    spdlog::warn("reload: an offer was taken as it was withdrawn; the files are compared again");
    reload::Plan plan = reload::plan(in_force(), wanted_, outputs());
    offers_.make(plan, wanted_);
    plan_ = std::move(plan);
    if (later) offers_.hold_unjudged(plan_);
  }
  if ((followed.changed || followed.taken_after) && later) status_.publish(plan_);
}

void Reloader::finish_taking() {
  if (!offers_.all_judged() && Clock::now() - current_.taking_since < kTakingPatience) return;
  offers_.hold_unjudged(plan_);
  const bool in_force = plan_.all_in_force();
  std::vector<std::string> lines = reload::to_lines(plan_);
  for (const std::string& line : lines) {
    spdlog::log(in_force ? spdlog::level::info : spdlog::level::warn, "reload: {}", line);
  }
  spdlog::info("reload: done, {}", in_force ? "everything in the files is in force"
                                            : "not everything in the files is in force");
  status_.publish(plan_);
  const std::uint64_t ticket = write_down(
      what_was_done(plan_) +
      (current_.job->kept.empty() ? "" : "; it had waited: " + current_.job->kept) +
      (current_.replaces_gains ? "; the files' gains replace gains that were not in the files"
                               : ""));
  finish({.outcome = in_force ? "in_force" : "waits",
          .lines = std::move(lines),
          .plan = reload::told(plan_)},
         ticket);
}

// Gains that are now in the file need no offer.
void Reloader::note_gains_of_file(const config::Configuration& wanted) {
  for (const config::LoopConfig& loop : wanted.loops) {
    const std::optional<std::size_t> index = find_loop(loops_, loop.name);
    if (!index) continue;
    CurrentSettings& settings = *loops_[*index].settings;
    if (settings.get().controller.pid.gains == loop.controller.pid.gains) {
      settings.gains_of_file(loop.controller.pid.gains);
    }
  }
}

void Reloader::refuse(const ReadFiles& read) {
  const std::vector<config::Diagnostic>& diagnostics = read.files.diagnostics;
  current_.diagnostics = reload::told(diagnostics);
  std::vector<std::string> lines;
  for (const config::Diagnostic& d : diagnostics) lines.push_back(config::to_text(d));
  if (!read.error.empty()) lines.push_back(read.error);
  refuse(read.error.empty() ? first_error(diagnostics) : read.error, std::move(lines), {});
}

void Reloader::refuse(const std::string& why, std::vector<std::string> lines,
                      protocol::ReloadOutcome result) {
  std::uint64_t ticket = 0;
  if (!current_.job->dry_run) {
    for (const std::string& line : lines) spdlog::error("{}", line);
    spdlog::error("reload refused: {}; the loops run on as before", why);
    status_.refused(why);
    current_.hash_before = config_hash();
    status_.publish(plan_);
    ticket = write_down("refused: " + why);
  }
  result.outcome = "refused";
  result.lines = std::move(lines);
  result.why = why;
  finish(std::move(result), ticket);
}

void Reloader::finish(protocol::ReloadOutcome result, std::uint64_t journal_ticket) {
  result.diagnostics = std::exchange(current_.diagnostics, std::nullopt);
  result.config_hash = config_hash();
  const bool dry_run = current_.job->dry_run;
  queue_.finish(*current_.job, std::move(result), journal_ticket);
  current_.job = nullptr;
  if (!dry_run) callbacks_.ready();
}

std::uint64_t Reloader::write_down(const std::string& result) const {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = base::utc_ms();
  line.peer = current_.job->peer;
  line.what = "reload";
  line.old_value = fmt::format("{:08x}", current_.hash_before);
  line.new_value = fmt::format("{:08x}", config_hash());
  line.result = result;
  return journal_.post(std::move(line));
}

config::Configuration Reloader::in_force() const {
  config::Configuration all{.daemon = running_, .loops = {}, .text = {}};
  for (const LoopRuntime& loop : loops_) {
    const rt::LoopSettings settings = loop.settings->get();
    config::LoopConfig& config = all.loops.emplace_back(loop.config);
    config.controller = settings.controller;
    config.safety = settings.safety;
    config.pv = settings.pv_check;
  }
  return all;
}

std::vector<reload::Output> Reloader::outputs() const {
  std::vector<reload::Output> all;
  for (std::size_t i = 0; i < loops_.size(); ++i) all.push_back(output(i));
  return all;
}

reload::Output Reloader::output(std::size_t loop) const {
  record::RecordRow row;
  const rt::LoopAvailability availability =
      rt::unpacked(loops_[loop].channels->availability.load(std::memory_order_acquire));
  const bool there = historian_.latest(loop, row);
  return {.known = there && availability.output_known, .value = there ? row.co : 0.0};
}

}  // namespace loopwarden::daemon
