// SPDX-License-Identifier: Apache-2.0
// Reloads that were asked for, and what has become of them. Any thread.
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
  bool take_file = false;  // also where a person's gains are not in the file
  std::string kept{};      // why it was not carried out when it was requested; empty: it is
  State state = State::waiting;
  protocol::ReloadOutcome result;  // once it is done
  std::uint64_t journal_ticket = 0;
};

class ReloadQueue {
 public:
  explicit ReloadQueue(journal::Journal& journal) : journal_(journal) {}

  // The number to ask for with state(); throws std::runtime_error where too many wait.
  std::uint64_t post(const std::string& peer, bool dry_run, bool take_file);
  // SIGHUP. One that has not begun yet reads the files of after this one, too.
  void by_signal();
  // One that was refused for the moment, once more.
  struct Kept {
    std::string peer;
    bool take_file = false;
    std::string why;
  };
  void again(const Kept& kept);
  // Nothing: there is no such reload any more.
  std::optional<protocol::ReloadState> state(std::uint64_t number) const;

  // Who carries them out. The oldest that waits; null: there is none.
  std::shared_ptr<ReloadJob> next() const;
  void set(ReloadJob& job, ReloadJob::State state);
  void finish(ReloadJob& job, protocol::ReloadOutcome result, std::uint64_t journal_ticket);

 private:
  std::uint64_t add(ReloadJob job);

  journal::Journal& journal_;
  mutable std::mutex mutex_;  // for what follows, and what is in a job
  std::deque<std::shared_ptr<ReloadJob>> jobs_;
  std::uint64_t newest_ = 0;
};

}  // namespace loopwarden::daemon
