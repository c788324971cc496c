// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload_queue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <utility>

namespace loopwarden::daemon {
namespace {

constexpr std::size_t kMostWaiting = 8;
constexpr std::size_t kMostKept = 16;
constexpr const char* kBySignal = "SIGHUP";

}  // namespace

std::uint64_t ReloadQueue::add(ReloadJob job) {
  job.number = ++newest_;
  jobs_.push_back(std::make_shared<ReloadJob>(std::move(job)));
  while (jobs_.size() > kMostKept && jobs_.front()->state == ReloadJob::State::done) {
    jobs_.pop_front();
  }
  return newest_;
}

std::uint64_t ReloadQueue::post(const std::string& peer, bool dry_run, bool take_file) {
  const std::lock_guard lock(mutex_);
  const auto open = std::count_if(jobs_.begin(), jobs_.end(), [](const auto& job) {
    return job->state != ReloadJob::State::done;
  });
  if (open >= static_cast<std::ptrdiff_t>(kMostWaiting)) {
    throw std::runtime_error(fmt::format("{} reloads are waiting; try again later", open));
  }
  ReloadJob job;
  job.peer = peer;
  job.dry_run = dry_run;
  job.take_file = take_file;
  return add(std::move(job));
}

void ReloadQueue::by_signal() {
  const std::lock_guard lock(mutex_);
  if (std::any_of(jobs_.begin(), jobs_.end(), [](const auto& job) {
        return job->by_signal && job->state == ReloadJob::State::waiting;
      })) {
    return;
  }
  ReloadJob job;
  job.peer = kBySignal;
  job.by_signal = true;
  add(std::move(job));
}

void ReloadQueue::again(const Kept& kept) {
  const std::lock_guard lock(mutex_);
  ReloadJob job;
  job.peer = kept.peer;
  job.take_file = kept.take_file;
  job.kept = kept.why;
  add(std::move(job));
}

std::optional<protocol::ReloadState> ReloadQueue::state(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(jobs_.begin(), jobs_.end(),
                                  [&](const auto& job) { return job->number == number; });
  if (found == jobs_.end()) return std::nullopt;
  const ReloadJob& job = **found;
  switch (job.state) {
    case ReloadJob::State::waiting: return protocol::ReloadState{"waiting"};
    case ReloadJob::State::reading: return protocol::ReloadState{"reading"};
    case ReloadJob::State::taking: return protocol::ReloadState{"taking"};
    case ReloadJob::State::done: break;
  }
  protocol::ReloadState all{"done", job.result};
  all.outcome->dry_run = job.dry_run;
  all.outcome->on_disk =
      job.dry_run || journal_.wait_written(job.journal_ticket, std::chrono::milliseconds(0));
  return all;
}

std::shared_ptr<ReloadJob> ReloadQueue::next() const {
  const std::lock_guard lock(mutex_);
  const auto next = std::find_if(jobs_.begin(), jobs_.end(), [](const auto& job) {
    return job->state == ReloadJob::State::waiting;
  });
  return next == jobs_.end() ? nullptr : *next;
}

void ReloadQueue::set(ReloadJob& job, ReloadJob::State state) {
  const std::lock_guard lock(mutex_);
  job.state = state;
}

void ReloadQueue::finish(ReloadJob& job, protocol::ReloadOutcome result,
                         std::uint64_t journal_ticket) {
  const std::lock_guard lock(mutex_);
  job.result = std::move(result);
  job.journal_ticket = journal_ticket;
  job.state = ReloadJob::State::done;
}

}  // namespace loopwarden::daemon
