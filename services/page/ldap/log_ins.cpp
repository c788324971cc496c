// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/log_ins.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

namespace loopwarden::page::ldap {
namespace {

constexpr std::size_t kMostJobs = 8;
constexpr std::size_t kStackBytes = 1024UL * 1024UL;
constexpr std::chrono::milliseconds kLook{10'000};  // longest duration of one check
// Pause after a check without an answer.
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

bool Worker::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

std::shared_future<Outcome> Worker::begin(const std::string& name, const std::string& password,
                                          const std::string& whose, Moment until) {
  std::shared_future<Outcome> answer;
  {
    const std::lock_guard lock(mutex_);
    const auto same = std::count_if(jobs_.begin(), jobs_.end(),
                                    [&](const Job& job) { return job.whose == whose; });
    if (quit_ || jobs_.size() >= kMostJobs || static_cast<std::size_t>(same) >= kMostJobs / 2)
      return answer;
    jobs_.push_back({name, password, whose, until, {}});
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
    // A log-in does not wait for a round of checks.
    job ? answer(std::move(*job)) : look_again();
  }
}

void Worker::answer(Job job) {
  try {
    job.answer.set_value(server_.log_in(job.name, job.password, {}, job.until));
  } catch (...) {
    job.answer.set_exception(std::current_exception());
  }
}

// Checks one user per call, so that an entry that can't be asked keeps no other user logged in.
void Worker::look_again() {
  const Moment now = std::chrono::steady_clock::now();
  const std::vector<std::string> names = users_.of_directory();
  std::erase_if(due_, [&](const auto& one) {
    return std::find(names.begin(), names.end(), one.first) == names.end();
  });
  for (const std::string& name : names) due_.try_emplace(name, now);
  const auto first = [this] {
    return std::min_element(due_.begin(), due_.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
  };
  if (!due_.empty() && first()->second <= now) {
    const auto one = first();
    const bool said = look_at(one->first);
    one->second = now + (said ? again_ : std::min(again_, kSoon));
  }
  // Users who log in meanwhile are checked after `again_` at the latest.
  next_ = due_.empty() ? now + again_ : std::min(first()->second, now + again_);
}

bool Worker::look_at(const std::string& name) {
  if (!sessions_.has(name, std::chrono::steady_clock::now())) {
    users_.dismiss(name);
    return true;
  }
  const Outcome outcome = server_.look_up(name, std::chrono::steady_clock::now() + kLook);
  if (outcome.end == Outcome::End::unavailable) {
    // Logged once for all users who stay logged in.
    if (trouble_ != outcome.why)
      spdlog::warn("directory: {}; users who are logged in stay logged in", outcome.why);
    trouble_ = outcome.why;
    return false;
  }
  trouble_.clear();
  if (outcome.end == Outcome::End::admitted) {
    users_.admit(name, outcome.role, outcome.dn);
    return true;
  }
  spdlog::info("{} is logged out by the directory: {}", name, outcome.why);
  users_.dismiss(name);
  sessions_.end_all(name);
  return true;
}

}  // namespace loopwarden::page::ldap
