// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reloader.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <span>
#include <stdexcept>
#include <utility>

#include "config/config_reader.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::daemon {
namespace {

using reload::Decision;
using reload::LoopPlan;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostWaiting = 8;
constexpr std::size_t kMostKept = 16;
constexpr std::chrono::seconds kTakingPatience{2};  // a slow loop takes its settings later
constexpr const char* kBySignal = "SIGHUP";

std::uint32_t hash_of(const std::string& text) {
  return record::crc32(std::span(text.data(), text.size()));
}

std::int64_t utc_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// What is in force while something waits is no set of files: its hash is equal to that of none, and
// the same only where the same of the same files is in force.
std::uint32_t hash_of_mixture(std::uint32_t start, std::uint32_t files, const reload::Plan& plan) {
  std::string text = fmt::format("{:08x} {:08x}\n", start, files);
  const auto add = [&](const reload::FilePlan& keys, const std::vector<reload::Change>& more) {
    for (const auto* changes : {&keys.waiting_for_restart, &more}) {
      for (const reload::Change& change : *changes) {
        text += fmt::format("{}: {} {} {}\n", keys.file, change.key, change.from, change.to);
      }
    }
  };
  add(plan.daemon, {});
  for (const LoopPlan& loop : plan.loops) add(loop.keys, loop.waiting_for_output);
  return hash_of(text);
}

std::string first_error(std::span<const config::Diagnostic> diagnostics) {
  const auto first = std::find_if(
      diagnostics.begin(), diagnostics.end(),
      [](const config::Diagnostic& d) { return d.level == config::Diagnostic::Level::error; });
  return first == diagnostics.end() ? std::string() : config::to_text(*first);
}

std::size_t waiting_keys(const reload::Plan& plan) {
  std::size_t count = plan.daemon.waiting_for_restart.size();
  for (const LoopPlan& loop : plan.loops) {
    count += loop.keys.waiting_for_restart.size() + loop.waiting_for_output.size();
  }
  return count;
}

}  // namespace

Reloader::Reloader(const config::Configuration& started, std::filesystem::path folder,
                   std::vector<LoopRuntime>& loops, const Historian& historian,
                   journal::Journal& journal, ReloaderEnds ends)
    : running_(started),
      folder_(std::move(folder)),
      loops_(loops),
      historian_(historian),
      journal_(journal),
      ends_(std::move(ends)),
      start_hash_(hash_of(started.text)),
      files_hash_(start_hash_),
      offered_(started.loops.size(), 0),
      config_hash_(start_hash_) {
  running_.text.clear();
  publish();
}

std::uint64_t Reloader::post(const std::string& peer, bool dry_run) {
  const std::lock_guard lock(mutex_);
  const auto open = std::count_if(jobs_.begin(), jobs_.end(),
                                  [](const auto& job) { return job->state != State::done; });
  if (open >= static_cast<std::ptrdiff_t>(kMostWaiting)) {
    throw std::runtime_error(fmt::format("{} reloads wait already; try again later", open));
  }
  auto job = std::make_shared<Job>();
  job->number = ++newest_;
  job->peer = peer;
  job->dry_run = dry_run;
  jobs_.push_back(std::move(job));
  while (jobs_.size() > kMostKept && jobs_.front()->state == State::done) jobs_.pop_front();
  return newest_;
}

// One that has not begun yet reads the files of after this one, too.
void Reloader::by_signal() {
  const std::lock_guard lock(mutex_);
  if (std::any_of(jobs_.begin(), jobs_.end(),
                  [](const auto& job) { return job->by_signal && job->state == State::waiting; })) {
    return;
  }
  auto job = std::make_shared<Job>();
  job->number = ++newest_;
  job->peer = kBySignal;
  job->by_signal = true;
  jobs_.push_back(std::move(job));
  while (jobs_.size() > kMostKept && jobs_.front()->state == State::done) jobs_.pop_front();
}

std::optional<protocol::ReloadState> Reloader::state(std::uint64_t number) const {
  std::shared_ptr<const Job> job;
  const std::lock_guard lock(mutex_);
  for (const auto& one : jobs_) {
    if (one->number == number) job = one;
  }
  if (!job) return std::nullopt;
  switch (job->state) {
    case State::waiting: return protocol::ReloadState{"waiting"};
    case State::reading: return protocol::ReloadState{"reading"};
    case State::taking: return protocol::ReloadState{"taking"};
    case State::done: break;
  }
  protocol::ReloadState all{"done", job->result};
  all.outcome->dry_run = job->dry_run;
  all.outcome->on_disk =
      job->dry_run || journal_.wait_written(job->journal_ticket, std::chrono::milliseconds(0));
  return all;
}

protocol::ConfigurationStatus Reloader::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Reloader::set_state(State state) {
  const std::lock_guard lock(mutex_);
  job_->state = state;
}

std::shared_ptr<Reloader::Job> Reloader::next_job() {
  const std::lock_guard lock(mutex_);
  const auto next = std::find_if(jobs_.begin(), jobs_.end(),
                                 [](const auto& job) { return job->state == State::waiting; });
  return next == jobs_.end() ? nullptr : *next;
}

void Reloader::step() {
  follow_offers();
  if (!job_) begin_reading();
  if (!job_) return;
  try {
    if (reading_) {
      look_at_reading();
    } else {
      finish_taking();
    }
  } catch (const std::exception& e) {
    // Such as memory that can't be had. What the loops have been offered is taken down next time; of
    // what has not come so far nothing is done, and nobody is to wait for it.
    if (job_->state == State::taking) throw;
    const std::lock_guard lock(mutex_);
    reading_ = nullptr;
    refused_ = e.what();
    job_->result = {.outcome = "refused", .config_hash = config_hash(), .why = e.what()};
    job_->state = State::done;
    job_ = nullptr;
    ends_.ready();
    throw;
  }
}

void Reloader::begin_reading() {
  std::shared_ptr<Job> job = next_job();
  if (!job) return;
  auto reading = std::make_shared<ReadFiles>();
  const bool begun = reader_.begin([reading, path = folder_] {
    try {
      reading->files = config::read_configuration(path);
    } catch (const std::exception& e) {
      reading->error = e.what();
    }
    reading->there.store(true, std::memory_order_release);
  });
  if (!begun) return;  // the thread is about to finish the last one
  reading_ = std::move(reading);
  job_ = std::move(job);
  slow_reported_ = false;
  set_state(State::reading);
  if (job_->dry_run) return;
  spdlog::info("reload by {}", job_->peer);
  ends_.reloading();
}

void Reloader::look_at_reading() {
  constexpr double kSlow = 10.0;  // s
  if (reading_->there.load(std::memory_order_acquire)) {
    const std::shared_ptr<ReadFiles> read = std::exchange(reading_, nullptr);
    take(*read);
  } else if (reader_.seconds() > kSlow && !slow_reported_) {
    slow_reported_ = true;
    spdlog::error("reload: the disk has not answered for {:.0f} s; the loops run on as before",
                  reader_.seconds());
  }
}

void Reloader::take(const ReadFiles& read) {
  if (!read.files) {
    refuse(read);
    return;
  }
  warnings_ = reload::told(read.files.diagnostics);
  const config::Configuration& wanted = *read.files;
  reload::Plan plan = reload::plan(in_force(), wanted, outputs());
  if (job_->dry_run) {
    const char* outcome = plan.all_in_force() ? "in_force" : "waits";
    std::vector<std::string> lines = reload::to_lines(plan);
    finish({.outcome = outcome, .lines = std::move(lines), .plan = reload::told(plan)});
    return;
  }
  for (const config::Diagnostic& d : read.files.diagnostics) {
    spdlog::warn("{}", config::to_text(d));
  }
  hash_before_ = config_hash();
  files_hash_ = hash_of(wanted.text);
  refused_.clear();
  taking_since_ = Clock::now();
  offer(std::move(plan), wanted);
  set_state(State::taking);
  reload::apply(wanted.daemon, running_.daemon);
  ends_.take_over(wanted.daemon);
}

// All that may fail comes first: the plan is carried out as a whole.
void Reloader::offer(reload::Plan plan, const config::Configuration& wanted) {
  std::vector<Offer> offers;
  for (std::size_t k = 0; k < plan.loops.size(); ++k) {
    const LoopPlan& planned = plan.loops[k];
    if (planned.decision != Decision::apply && planned.decision != Decision::wait_for_output) {
      continue;
    }
    // A loop of which nothing changes is left as it is, with what was ordered of its jacket.
    if (planned.keys.applied.empty() && planned.waiting_for_output.empty()) continue;
    const auto loop = std::find_if(loops_.begin(), loops_.end(), [&](const LoopRuntime& l) {
      return l.config.name == planned.loop;
    });
    const auto config =
        std::find_if(wanted.loops.begin(), wanted.loops.end(),
                     [&](const config::LoopConfig& c) { return c.name == planned.loop; });
    offers.push_back({.loop = static_cast<std::size_t>(loop - loops_.begin()),
                      .plan_loop = k,
                      .number = 0,
                      .judged = false,
                      .taken = false,
                      .wanted = *config});
  }
  plan_ = std::move(plan);
  // What an earlier reload has left waiting is replaced, or no longer wanted.
  for (const Offer& old : std::exchange(offers_, {})) {
    loops_[old.loop].channels->settings.publish(
        {.settings = {}, .number = ++offered_[old.loop], .withdrawn = true});
  }
  for (Offer& offer : offers) {
    const LoopRuntime& loop = loops_[offer.loop];
    offer.number = ++offered_[offer.loop];
    loop.channels->settings.publish(
        {.settings = settings_of(offer.wanted, config::backing_of(loop.config.io)),
         .number = offer.number});
  }
  offers_ = std::move(offers);
}

void Reloader::follow_offers() {
  const bool later =
      !job_ || job_->state != State::taking;  // than their reload was told to be done
  bool changed = false;
  for (Offer& offer : offers_) {
    const rt::LoopChannels& channels = *loops_[offer.loop].channels;
    LoopPlan& planned = plan_.loops[offer.plan_loop];
    if (channels.settings_taken.load(std::memory_order_acquire) == offer.number) {
      const bool waited = planned.decision == Decision::wait_for_output;
      reload::confirm(planned);
      if (waited && later) {
        spdlog::info("reload: {}: in force now", planned.loop);
        journal::JournalEntry line;
        line.kind = journal::JournalEntry::Kind::system;
        line.utc_ms = utc_ms();
        line.loop = planned.loop;
        line.what = "reload";
        line.result = "done: what had waited is in force";
        journal_.post(std::move(line));
      }
      offer.taken = true;
      changed = true;
    } else if (!offer.judged &&
               channels.settings_waiting.load(std::memory_order_acquire) == offer.number) {
      offer.judged = true;
      reload::hold(planned, reload::why_held(offer.wanted, outputs()[offer.loop]));
      changed = true;
    }
  }
  std::erase_if(offers_, [](const Offer& offer) { return offer.taken; });
  if (changed && later) publish();
}

void Reloader::finish_taking() {
  const bool all_judged =
      std::all_of(offers_.begin(), offers_.end(), [](const Offer& offer) { return offer.judged; });
  if (!all_judged && Clock::now() - taking_since_ < kTakingPatience) return;
  for (const Offer& offer : offers_) {
    LoopPlan& planned = plan_.loops[offer.plan_loop];
    if (offer.judged || planned.keys.applied.empty()) continue;
    reload::hold(planned, fmt::format("for the loop's next cycle, at most {:g} s away",
                                      offer.wanted.sample_time_s));
  }
  const bool in_force = plan_.all_in_force();
  std::vector<std::string> lines = reload::to_lines(plan_);
  for (const std::string& line : lines) {
    spdlog::log(in_force ? spdlog::level::info : spdlog::level::warn, "reload: {}", line);
  }
  spdlog::info("reload: done, {}", in_force ? "everything in the files is in force"
                                            : "not everything in the files is in force");
  publish();
  const std::size_t waiting = waiting_keys(plan_);
  job_->journal_ticket = write_down(
      *job_, waiting == 0 ? "done"
                          : fmt::format("done; {} key{} wait{}", waiting, waiting == 1 ? "" : "s",
                                        waiting == 1 ? "s" : ""));
  finish({.outcome = in_force ? "in_force" : "waits",
          .lines = std::move(lines),
          .plan = reload::told(plan_)});
}

void Reloader::refuse(const ReadFiles& read) {
  const std::vector<config::Diagnostic>& diagnostics = read.files.diagnostics;
  const std::string why = read.error.empty() ? first_error(diagnostics) : read.error;
  warnings_ = reload::told(diagnostics);
  std::vector<std::string> lines;
  for (const config::Diagnostic& d : diagnostics) lines.push_back(config::to_text(d));
  if (!read.error.empty()) lines.push_back(read.error);
  if (!job_->dry_run) {
    for (const std::string& line : lines) spdlog::error("{}", line);
    spdlog::error("reload refused: {}; the loops run on as before",
                  read.error.empty() ? "the configuration has errors" : read.error);
    refused_ = why;
    hash_before_ = config_hash();
    publish();
    job_->journal_ticket = write_down(*job_, "refused: " + why);
  }
  finish({.outcome = "refused", .lines = std::move(lines), .why = why});
}

void Reloader::finish(protocol::ReloadOutcome result) {
  result.diagnostics = std::exchange(warnings_, std::nullopt);
  result.config_hash = config_hash();
  const bool dry_run = job_->dry_run;
  {
    const std::lock_guard lock(mutex_);
    job_->result = std::move(result);
    job_->state = State::done;
  }
  job_ = nullptr;
  if (!dry_run) ends_.ready();
}

std::uint64_t Reloader::write_down(const Job& job, const std::string& result) const {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = utc_ms();
  line.peer = job.peer;
  line.what = "reload";
  line.old_value = fmt::format("{:08x}", hash_before_);
  line.new_value = fmt::format("{:08x}", config_hash());
  line.result = result;
  return journal_.post(std::move(line));
}

// Status and hash follow from the plan as far as it has come.
void Reloader::publish() {
  const bool waits = !plan_.all_in_force();
  protocol::ConfigurationStatus status;
  status.refused = refused_;
  status.files_hash = files_hash_;
  status.files_in_force = !waits && refused_.empty();
  const auto add = [](std::vector<protocol::WaitingKey>& all, const std::string& file,
                      const std::vector<reload::Change>& changes) {
    for (const reload::Change& change : changes) all.push_back({change.key, file, change.why});
  };
  add(status.waiting_for_restart, plan_.daemon.file, plan_.daemon.waiting_for_restart);
  for (const LoopPlan& loop : plan_.loops) {
    add(status.waiting_for_restart, loop.keys.file, loop.keys.waiting_for_restart);
    add(status.waiting_for_output, loop.keys.file, loop.waiting_for_output);
  }
  config_hash_ = waits ? hash_of_mixture(start_hash_, files_hash_, plan_) : files_hash_;
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

config::Configuration Reloader::in_force() const {
  config::Configuration all = running_;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const rt::LoopSettings settings = loops_[i].settings->get();
    all.loops[i].controller = settings.controller;
    all.loops[i].safety = settings.safety;
    all.loops[i].pv = settings.pv_check;
  }
  return all;
}

std::vector<reload::Output> Reloader::outputs() const {
  std::vector<reload::Output> all;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    record::RecordRow row;
    const rt::Standing standing =
        rt::unpacked(loops_[i].channels->standing.load(std::memory_order_acquire));
    const bool there = historian_.latest(i, row);
    all.push_back({.known = there && standing.output_known, .value = there ? row.co : 0.0});
  }
  return all;
}

}  // namespace loopwarden::daemon
