// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/in_force.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "daemon/protocol/ask.hpp"

namespace loopwarden::protocol {
namespace {

std::optional<ReloadOutcome> dry_run(Daemon& daemon) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kPatience{10};  // for the daemon's disk
  const auto until = Clock::now() + kPatience;
  const std::uint64_t number = ask(daemon, ReloadRequest{.dry_run = true}).reload;
  for (;;) {
    ReloadState now = ask(daemon, ReloadStateRequest{.reload = number});
    if (now.outcome || Clock::now() > until) return std::move(now.outcome);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

// Returns whether a change is a gain that a command set, over a file that is otherwise in force.
bool is_ordered_gain(const KeyChange& change, const std::optional<LoopGains>& gains) {
  if (!gains || !gains->not_in_file) return false;
  const auto is = [&](const char* key, double file) {
    return change.key == key && change.to && *change.to == fmt::format("{}", file);
  };
  return is("controller.kp", gains->file.kp) || is("controller.ki", gains->file.ki) ||
         is("controller.kd", gains->file.kd);
}

std::string in_words(const std::vector<KeyChange>& changes) {
  std::string text;
  for (const KeyChange& change : changes) {
    text += text.empty() ? "" : ", ";
    text += change.from ? fmt::format("{} {} in force, {} in the file", change.key, *change.from,
                                      change.to.value_or(""))
                        : change.key;
  }
  return text;
}

// Returns the differences of a loop whose file was read, with the action to take.
std::string difference(const LoopPlan& plan, const std::optional<LoopGains>& gains,
                       const Remedies& remedies) {
  std::vector<KeyChange> by_reload = plan.applied;
  by_reload.insert(by_reload.end(), plan.waiting_for_output.begin(), plan.waiting_for_output.end());
  std::erase_if(by_reload, [&](const KeyChange& one) { return is_ordered_gain(one, gains); });
  const bool restart = !plan.waiting_for_restart.empty();
  if (by_reload.empty() && !restart) return {};
  std::vector<KeyChange> all = by_reload;
  all.insert(all.end(), plan.waiting_for_restart.begin(), plan.waiting_for_restart.end());
  return fmt::format("{}: {} is not in force: {}. {}", plan.loop, plan.file, in_words(all),
                     restart ? remedies.restart : remedies.reload);
}

}  // namespace

std::optional<LoopFile> file_of_loop(Daemon& daemon, const std::string& tag) {
  const std::optional<ReloadOutcome> read = dry_run(daemon);
  if (!read || !read->plan) return std::nullopt;
  for (const LoopPlan& loop : read->plan->loops) {
    if (loop.loop == tag && loop.file_hash) {
      return LoopFile{loop.file, *loop.file_hash, loop.file_time_s.value_or(0)};
    }
  }
  return std::nullopt;
}

std::string box_not_in_force(Daemon& daemon, const Remedies& remedies) {
  const std::optional<ReloadOutcome> read = dry_run(daemon);
  if (!read || !read->plan) return "the daemon cannot read its files. See its log.";
  const DaemonPlan& plan = read->plan->daemon;
  if (plan.applied.empty() && plan.waiting_for_restart.empty()) return {};
  const bool restart = !plan.waiting_for_restart.empty();
  return fmt::format("{} is not in force: {}. {}", plan.file,
                     in_words(restart ? plan.waiting_for_restart : plan.applied),
                     restart ? remedies.restart : remedies.reload);
}

std::string not_in_force(Daemon& daemon, const std::string& tag,
                         std::optional<std::uint32_t> file_hash, const Remedies& remedies) {
  const std::optional<ReloadOutcome> read = dry_run(daemon);
  if (!read) return tag + ": the daemon has not read its files within 10 s. Check its disk.";
  if (!read->plan) {
    return fmt::format("{}: the daemon refuses its files: {}. Correct them. {}", tag,
                       read->why.value_or("no reason given"), remedies.reload);
  }
  const auto plan = std::find_if(read->plan->loops.begin(), read->plan->loops.end(),
                                 [&](const LoopPlan& loop) { return loop.loop == tag; });
  if (plan == read->plan->loops.end() || plan->decision == "came") {
    return fmt::format("{}: the daemon does not run this loop. {}", tag, remedies.restart);
  }
  if (plan->decision == "gone") {
    return fmt::format("{}: the daemon runs this loop without a file. Write its file back.", tag);
  }
  const Status status = ask(daemon, StatusRequest{});
  const auto loop = std::find_if(status.loops.begin(), status.loops.end(),
                                 [&](const LoopStatus& one) { return one.name == tag; });
  std::string differs =
      difference(*plan, loop == status.loops.end() ? std::nullopt : loop->gains, remedies);
  if (!differs.empty() || !file_hash) return differs;
  if (!plan->file_hash) {
    return fmt::format("{}: the daemon has an older version. {}", tag, remedies.restart);
  }
  if (*plan->file_hash != *file_hash) {
    return fmt::format(
        "{}: the daemon reads {}, which has a different text. Name its folder with --config.", tag,
        plan->file);
  }
  return {};
}

}  // namespace loopwarden::protocol
