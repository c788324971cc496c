// SPDX-License-Identifier: Apache-2.0
#include "daemon/explain/explainer.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/explain/explanation_file.hpp"
#include "daemon/explain/pending_explanation.hpp"
#include "base/child_process.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kLook{100};

// Writes the minutes. Their time counts from the alarm.
void write_minutes(const supervision::History::Minutes& minutes, std::uint64_t raised_at,
                   const fs::path& path) {
  record::RecordCsvWriter csv(path, {.stem = false});
  const auto first = static_cast<double>(minutes.end) - static_cast<double>(minutes.pv.size());
  for (std::size_t k = 0; k < minutes.pv.size(); ++k) {
    const double cycle = first + static_cast<double>(k) - static_cast<double>(raised_at);
    csv.add({.time_s = minutes.period_s * cycle,
             .pv = minutes.pv[k],
             .sp = minutes.sp[k],
             .co = minutes.co[k]});
  }
  csv.finish();
}

double after_alarm_s(const supervision::History::Minutes& minutes, std::uint64_t raised_at) {
  return minutes.period_s * (static_cast<double>(minutes.end) - static_cast<double>(raised_at));
}

// Returns whether a restart left too few minutes, so that the explanation is inconclusive.
bool cut_short(const ExplainJob& job, const Explanation& explanation) {
  return job.resumed_s && *job.resumed_s < job.enough_s && explanation.verdict == kNotExplained;
}

void tell_no_room(const ExplainJob& job) {
  spdlog::warn("explanation: the queue is full; {} is not explained again", job.folder.string());
}

void tell_cut_short(const ExplainJob& job, Explanation& explanation) {
  explanation.sentence = fmt::format(
      "Not explained: the restart of the daemon left too few minutes ({:.1f} min after the alarm, "
      "{:.1f} min are required). {}",
      *job.resumed_s / 60.0, job.enough_s / 60.0, explanation.sentence);
  write_not_explained(explanation);
}

}  // namespace

Explainer::Explainer(ExplainerSettings settings, Minutes minutes, Report report)
    : settings_(std::move(settings)), minutes_(std::move(minutes)), report_(std::move(report)) {}

void Explainer::start() {
  thread_.start({.name = "lw-explain"}, [this] { run(); });
}

void Explainer::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool Explainer::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

void Explainer::post(ExplainJob job) {
  if (settings_.program.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    if (make_room(job)) {
      const auto now = Clock::now();
      const auto due = now + job.wait;
      queue_.push_back({std::move(job), due, now});
      status_.waiting = explanations();
      changed_.notify_all();
      return;
    }
    ++status_.failed;
  }
  if (job.repeat) return tell_no_room(job);  // the previous explanation stays
  report_(job, nullptr, fmt::format("{} explanations are waiting already", settings_.most_waiting));
}

std::size_t Explainer::explanations() const {
  return static_cast<std::size_t>(std::count_if(
      queue_.begin(), queue_.end(), [](const Waiting& one) { return !one.job.is_search(); }));
}

bool Explainer::make_room(const ExplainJob& job) {
  if (job.is_search()) {
    queue_.remove_if([&](const Waiting& one) {
      return one.job.is_search() && one.job.loop == job.loop && !one.at_work;
    });
    return true;
  }
  const auto waiting =
      static_cast<std::size_t>(std::count_if(queue_.begin(), queue_.end(), [](const Waiting& one) {
        return !one.at_work && !one.job.is_search();
      }));
  if (waiting < settings_.most_waiting) return true;
  if (job.repeat) return false;
  const auto newest = std::find_if(queue_.rbegin(), queue_.rend(), [](const Waiting& one) {
    return one.job.repeat && !one.at_work && !one.job.is_search();
  });
  if (newest == queue_.rend()) return false;
  tell_no_room(newest->job);
  ++status_.failed;
  queue_.erase(std::next(newest).base());
  return true;
}

void Explainer::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

ExplainerStatus Explainer::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

Explainer::Item Explainer::next_to_save() {
  Item next = queue_.end();
  for (Item it = queue_.begin(); it != queue_.end(); ++it) {
    const bool saved = !it->job.resumed_s && !it->job.repeat;
    if (saved && (next == queue_.end() || it->save < next->save)) next = it;
  }
  return next;
}

Explainer::Item Explainer::next_to_explain() {
  const auto rank = [now = Clock::now()](const Waiting& one) {
    const bool due = one.due <= now;
    return std::tuple(!due, due && one.job.repeat, one.due);
  };
  return std::min_element(queue_.begin(), queue_.end(),
                          [&](const Waiting& a, const Waiting& b) { return rank(a) < rank(b); });
}

bool Explainer::is_due() const {
  const auto now = Clock::now();
  return std::any_of(queue_.begin(), queue_.end(),
                     [&](const Waiting& one) { return one.due <= now; });
}

// Saves the minutes of one waiting job. While the lock is free, other threads may append jobs and
// drop repeats; this job is not a repeat.
bool Explainer::save_one(std::unique_lock<std::mutex>& lock) {
  const Item unsaved = next_to_save();
  if (unsaved == queue_.end() || unsaved->save > Clock::now()) return false;
  lock.unlock();
  save(unsaved->job);
  lock.lock();
  unsaved->save = Clock::now() + settings_.save;
  return true;
}

bool Explainer::work_between(std::unique_lock<std::mutex>& lock) {
  woken_ = false;
  if (!settings_.spare) return false;
  lock.unlock();
  const bool worked = settings_.spare([this](std::chrono::milliseconds patience) {
    std::unique_lock waiting(mutex_);
    if (!quit_ && !is_due()) changed_.wait_for(waiting, patience);
    while (save_one(waiting)) {
    }
    return quit_ || is_due();
  });
  lock.lock();
  return worked || woken_;
}

void Explainer::run() {
  std::unique_lock lock(mutex_);
  // Starts with the other work, whatever is due, because that work must first load its state.
  work_between(lock);
  while (!quit_) {
    if (save_one(lock)) continue;
    if (!is_due() && work_between(lock)) continue;
    const Item next = next_to_explain();
    if (next == queue_.end()) {
      if (!quit_ && !woken_) changed_.wait(lock);
      continue;
    }
    if (next->due > Clock::now()) {
      const Item unsaved = next_to_save();
      changed_.wait_until(lock,
                          unsaved == queue_.end() ? next->due : std::min(next->due, unsaved->save));
      continue;
    }
    next->at_work = true;
    lock.unlock();
    const bool ended = explain(next->job);
    lock.lock();
    next->at_work = false;
    if (quit_) break;
    if (!ended) {
      next->job.renewed = true;
      next->due = Clock::now() + next->job.again;
      continue;
    }
    queue_.erase(next);
    status_.waiting = explanations();
  }
  const std::list<Waiting> left = queue_;
  lock.unlock();
  for (const Waiting& waiting : left) {
    if (!waiting.job.resumed_s && !waiting.job.repeat) save(waiting.job);
  }
}

// Saves the minutes. After a failure it is tried again later; until then a restart would lose them.
void Explainer::save(const ExplainJob& job) noexcept {
  if (job.resumed_s && !job.renewed) return;
  try {
    const supervision::History::Minutes minutes = minutes_(job.loop);
    const std::uint64_t first = minutes.end - minutes.pv.size();
    if (job.renewed) {
      if (!minutes.pv.empty()) write_minutes(minutes, first, job.folder / "minutes.csv");
      return;
    }
    if (first > job.raised_at) return;
    write_minutes(minutes, job.raised_at, job.folder / "minutes.csv");
    write_pending({.enough_s = job.enough_s, .there_s = after_alarm_s(minutes, job.raised_at)},
                  job.folder);
  } catch (const std::exception& e) {
    spdlog::warn("explanation: {}", e.what());
  }
}

bool Explainer::explain(const ExplainJob& job) {
  if (job.repeat && job.wanted && !job.wanted()) return true;
  std::string why;
  Explanation explanation;
  try {
    if (!job.is_search()) save(job);
    why = run_child(job);
    if (why.empty()) explanation = read_explanation(job.folder);
    if (why.empty() && cut_short(job, explanation)) {
      if (job.again.count() > 0 && !job.renewed) {
        // Otherwise the alarm would count as explained at the next start.
        fs::remove(job.folder / "explanation.json");
        return false;
      }
      tell_cut_short(job, explanation);
    }
  } catch (const std::exception& e) {
    why = e.what();
  }
  {
    const std::lock_guard lock(mutex_);
    if (quit_) return true;
    if (!job.is_search()) ++(why.empty() ? status_.explained : status_.failed);
  }
  end_pending(job.folder);
  report_(job, why.empty() ? &explanation : nullptr, why);
  return true;
}

std::string Explainer::run_child(const ExplainJob& job) {
  std::vector<std::string> arguments{"explain", "--background", job.folder.string()};
  if (job.is_search()) {
    arguments = {
        "valve-test", "--background",        "--plan", (job.folder / "next_test.yaml").string(),
        "--record",   job.segments.string(), "--out",  (job.folder / "test").string()};
  }
  base::ChildProcess child(settings_.program.string(), arguments);
  const auto deadline = Clock::now() + settings_.most_time;
  std::unique_lock lock(mutex_);
  for (;;) {
    if (const std::optional<int> code = child.ended()) {
      return *code == 0 ? "" : fmt::format("loopwarden {} ended with {}", arguments.front(), *code);
    }
    if (quit_) return "the daemon ends";
    if (Clock::now() >= deadline) {
      return fmt::format("not finished within {} s", settings_.most_time.count());
    }
    changed_.wait_for(lock, kLook);
  }
}

fs::path workbench_program() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  for (const fs::path& place : {self.parent_path() / "loopwarden",
                                self.parent_path().parent_path() / "bin" / "loopwarden"}) {
    if (access(place.c_str(), X_OK) == 0) return place;
  }
  return {};
}

}  // namespace loopwarden::daemon
