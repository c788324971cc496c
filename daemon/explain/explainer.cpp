// SPDX-License-Identifier: Apache-2.0
#include "daemon/explain/explainer.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "daemon/explain/explanation_file.hpp"
#include "hal/os/child_process.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;
constexpr std::chrono::milliseconds kLook{100};

// Time counts from the alarm.
void write_minutes(const monitor::History::Minutes& minutes, std::uint64_t raised_at,
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

}  // namespace

Explainer::Explainer(ExplainerSettings settings, Minutes minutes, Report report)
    : settings_(std::move(settings)), minutes_(std::move(minutes)), report_(std::move(report)) {}

void Explainer::start() {
  thread_.start({.name = "lw-explain"}, [this] { run(); });
}

void Explainer::ask_to_end() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
}

void Explainer::stop() {
  ask_to_end();
  thread_.join();
}

bool Explainer::stop_for(std::chrono::milliseconds patience) {
  ask_to_end();
  return thread_.join_for(patience);
}

void Explainer::post(ExplainJob job) {
  if (settings_.program.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() < settings_.most_waiting) {
      const auto due = std::chrono::steady_clock::now() + job.wait;
      queue_.push_back({std::move(job), due});
      status_.waiting = queue_.size();
      changed_.notify_all();
      return;
    }
    ++status_.failed;
  }
  report_(job, nullptr, fmt::format("{} explanations wait already", settings_.most_waiting));
}

ExplainerStatus Explainer::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Explainer::run() {
  std::unique_lock lock(mutex_);
  while (!quit_) {
    const auto next =
        std::min_element(queue_.begin(), queue_.end(),
                         [](const Waiting& a, const Waiting& b) { return a.due < b.due; });
    if (next == queue_.end()) {
      changed_.wait(lock);
      continue;
    }
    if (next->due > std::chrono::steady_clock::now()) {
      changed_.wait_until(lock, next->due);
      continue;
    }
    const ExplainJob job = next->job;
    lock.unlock();
    explain(job);
    lock.lock();
    // Others were only put behind it meanwhile.
    queue_.erase(next);
    status_.waiting = queue_.size();
  }
}

void Explainer::explain(const ExplainJob& job) {
  std::string why;
  Explanation explanation;
  try {
    write_minutes(minutes_(job.loop), job.raised_at, job.folder / "minutes.csv");
    why = run_child(job);
    if (why.empty()) explanation = read_explanation(job.folder);
  } catch (const std::exception& e) {
    why = e.what();
  }
  {
    const std::lock_guard lock(mutex_);
    if (quit_) return;
    ++(why.empty() ? status_.explained : status_.failed);
  }
  report_(job, why.empty() ? &explanation : nullptr, why);
}

std::string Explainer::run_child(const ExplainJob& job) {
  hal::os::ChildProcess child(settings_.program.string(),
                              {"explain", "--background", job.folder.string()});
  const auto deadline = std::chrono::steady_clock::now() + settings_.most_time;
  std::unique_lock lock(mutex_);
  for (;;) {
    if (const std::optional<int> code = child.ended()) {
      return *code == 0 ? "" : fmt::format("loopwarden explain ended with {}", *code);
    }
    if (quit_) return "the daemon ends";
    if (std::chrono::steady_clock::now() >= deadline) {
      return fmt::format("not there after {} s", settings_.most_time.count());
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
