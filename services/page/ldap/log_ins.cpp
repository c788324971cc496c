// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/log_ins.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

namespace loopwarden::page::ldap {
namespace {

constexpr std::size_t kMostJobs = 8;
constexpr std::size_t kStackBytes = 1024UL * 1024UL;
// After a look that got no answer.
constexpr std::chrono::milliseconds kSoon{60'000};

}  // namespace

Worker::Worker(Server server, UserDirectory& users, Sessions& sessions,
               std::chrono::milliseconds again)
    : server_(std::move(server)),
      users_(users),
      sessions_(sessions),
      again_(again),
      next_(std::chrono::steady_clock::now() + again) {
  thread_.start({.name = "pg-ldap", .stack_bytes = kStackBytes}, [this] { run(); });
}

void Worker::stop() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

std::shared_future<Outcome> Worker::begin(const std::string& name, const std::string& password,
                                          const std::string& whose) {
  std::shared_future<Outcome> answer;
  {
    const std::lock_guard lock(mutex_);
    const auto same = std::count_if(jobs_.begin(), jobs_.end(),
                                    [&](const Job& job) { return job.whose == whose; });
    if (quit_ || jobs_.size() >= kMostJobs || static_cast<std::size_t>(same) >= kMostJobs / 2)
      return answer;
    jobs_.push_back({name, password, whose, {}});
    answer = jobs_.back().answer.get_future().share();
  }
  changed_.notify_one();
  return answer;
}

void Worker::run() {
  for (;;) {
    std::optional<Job> job;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_until(lock, next_, [&] { return quit_ || !jobs_.empty(); });
      if (quit_) return;
      if (!jobs_.empty()) {
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
    }
    // Who wants to log in does not wait for a round.
    if (!job) {
      look_again();
      continue;
    }
    try {
      job->answer.set_value(server_.log_in(job->name, job->password, {}));
    } catch (...) {
      job->answer.set_exception(std::current_exception());
    }
  }
}

void Worker::look_again() {
  const Moment now = std::chrono::steady_clock::now();
  if (due_.empty()) due_ = users_.of_directory();
  next_ = now + again_;
  if (due_.empty()) return;
  const std::string name = std::move(due_.back());
  due_.pop_back();
  if (!look_at(name)) {
    due_.clear();
    next_ = now + std::min(again_, kSoon);
  } else if (!due_.empty()) {
    next_ = now;
  }
}

bool Worker::look_at(const std::string& name) {
  if (!sessions_.has(name, std::chrono::steady_clock::now())) {
    users_.dismiss(name);
    return true;
  }
  const Outcome outcome = server_.look_up(name);
  switch (outcome.end) {
    case Outcome::End::admitted: users_.admit(name, outcome.role, outcome.dn); return true;
    case Outcome::End::unavailable:
      spdlog::warn("directory: {}; who is logged in stays", outcome.why);
      return false;
    case Outcome::End::wrong:
    case Outcome::End::no_group: break;
  }
  spdlog::info("{} is logged out by the directory: {}", name, outcome.why);
  users_.dismiss(name);
  sessions_.end_all(name);
  return true;
}

}  // namespace loopwarden::page::ldap
