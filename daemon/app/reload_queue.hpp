// SPDX-License-Identifier: Apache-2.0
// Requested reloads and their results. Thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/journal/journal.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

struct ReloadJob {
  enum class State : std::uint8_t { waiting, reading, taking, done };
  std::uint64_t number = 0;
  std::string peer;
  bool by_signal = false;
  bool dry_run = false;
  bool take_file = false;  // also if gains set by a user are not in the file
  std::string kept{};      // why it was postponed when it was requested; empty: not postponed
  State state = State::waiting;
  protocol::ReloadOutcome result;  // when it is done
  std::uint64_t journal_ticket = 0;
};

class ReloadQueue {
 public:
  explicit ReloadQueue(journal::Journal& journal) : journal_(journal) {}

  // Queues a reload. Returns its number for state(). Throws std::runtime_error if too many are
  // waiting.
  std::uint64_t post(const std::string& peer, bool dry_run, bool take_file);
  // Handles SIGHUP. A reload that has not started yet covers it, because it reads the files later.
  void by_signal();
  // A postponed reload, queued again.
  struct Kept {
    std::string peer;
    bool take_file = false;
    std::string why;
  };
  void again(const Kept& kept);
  // Returns nullopt if the reload is no longer stored.
  std::optional<protocol::ReloadState> state(std::uint64_t number) const;

  // For the executing thread: returns the oldest waiting reload; null: none.
  std::shared_ptr<ReloadJob> next() const;
  void set(ReloadJob& job, ReloadJob::State state);
  void finish(ReloadJob& job, protocol::ReloadOutcome result, std::uint64_t journal_ticket);

 private:
  std::uint64_t add(ReloadJob job);

  journal::Journal& journal_;
  mutable std::mutex mutex_;  // guards the members below and the contents of jobs
  std::deque<std::shared_ptr<ReloadJob>> jobs_;
  std::uint64_t newest_ = 0;
};

}  // namespace loopwarden::daemon
