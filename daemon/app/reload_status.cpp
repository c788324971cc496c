// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload_status.hpp"

#include <fmt/format.h>

#include <span>
#include <utility>
#include <vector>

#include "base/digest/digest.hpp"

namespace loopwarden::daemon {
namespace {

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
  for (const reload::LoopPlan& loop : plan.loops) add(loop.keys, loop.waiting_for_output);
  return base::crc32(text);
}

void add_keys(nlohmann::json& all, const std::string& file,
              const std::vector<reload::Change>& changes) {
  for (const reload::Change& change : changes) {
    all.push_back({{"file", file}, {"key", change.key}, {"why", change.why}});
  }
}

}  // namespace

ReloadStatus::ReloadStatus(std::uint32_t start_hash)
    : start_hash_(start_hash), files_hash_(start_hash), config_hash_(start_hash) {
  publish({});
}

void ReloadStatus::taken(std::uint32_t files_hash) {
  files_hash_ = files_hash;
  refused_.clear();
}

void ReloadStatus::publish(const reload::Plan& plan) {
  nlohmann::json restart = nlohmann::json::array();
  nlohmann::json output = nlohmann::json::array();
  add_keys(restart, plan.daemon.file, plan.daemon.waiting_for_restart);
  for (const reload::LoopPlan& loop : plan.loops) {
    add_keys(restart, loop.keys.file, loop.keys.waiting_for_restart);
    add_keys(output, loop.keys.file, loop.waiting_for_output);
  }
  const bool waits = !plan.all_in_force();
  nlohmann::json status = {{"files_hash", files_hash_},
                           {"files_in_force", !waits && refused_.empty()},
                           {"waiting_for_restart", std::move(restart)},
                           {"waiting_for_output", std::move(output)},
                           {"refused", refused_}};
  config_hash_ = waits ? hash_of_mixture(start_hash_, files_hash_, plan) : files_hash_;
  const std::lock_guard lock(mutex_);
  json_ = std::move(status);
}

nlohmann::json ReloadStatus::json() const {
  const std::lock_guard lock(mutex_);
  return json_;
}

}  // namespace loopwarden::daemon
