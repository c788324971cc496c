// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload_status.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "base/digest/digest.hpp"

namespace loopwarden::daemon {
namespace {

// Returns the hash of a mixture: some changes are in force, others wait. The hash equals that of no
// set of files. It is the same again only if the same changes of the same files are in force.
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

void add_keys(std::vector<protocol::WaitingKey>& all, const std::string& file,
              const std::vector<reload::Change>& changes) {
  for (const reload::Change& change : changes) all.push_back({change.key, file, change.why});
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
  const bool waits = !plan.all_in_force();
  protocol::ConfigurationStatus status;
  status.refused = refused_;
  status.files_hash = files_hash_;
  status.files_in_force = !waits && refused_.empty();
  add_keys(status.waiting_for_restart, plan.daemon.file, plan.daemon.waiting_for_restart);
  for (const reload::LoopPlan& loop : plan.loops) {
    add_keys(status.waiting_for_restart, loop.keys.file, loop.keys.waiting_for_restart);
    add_keys(status.waiting_for_output, loop.keys.file, loop.waiting_for_output);
  }
  config_hash_ = waits ? hash_of_mixture(start_hash_, files_hash_, plan) : files_hash_;
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

protocol::ConfigurationStatus ReloadStatus::get() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

}  // namespace loopwarden::daemon
