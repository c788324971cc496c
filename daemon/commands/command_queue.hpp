// SPDX-License-Identifier: Apache-2.0
// One sender's queue of commands to one loop. It numbers the commands, tracks the unanswered ones,
// and writes each command to the journal with the result from the loop's cycle.
//
// For the sender's thread only.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/journal_entry.hpp"
#include "daemon/rt/command.hpp"

namespace loopwarden::daemon::commands {

// The result of a command.
struct Outcome {
  std::uint64_t number = 0;
  rt::Refusal refusal = rt::Refusal::none;
  rt::InForce now{};                 // values when the cycle took it
  std::string why;                   // empty: the command was done
  std::uint64_t journal_ticket = 0;  // of its last line
  std::chrono::steady_clock::time_point answered{};
};

struct CommandCallbacks {
  // Returns the journal's ticket.
  std::function<std::uint64_t(journal::JournalEntry)> write_down;
  std::function<std::string(const rt::CommandAnswer&, const rt::Command&)> why;
  // Called when a command is in force, with the first of its lines, before that is written.
  std::function<void(const rt::Command&, const journal::JournalEntry&)> done{};
};

class CommandQueue {
 public:
  static constexpr std::size_t kOutcomesKept = 64;

  // `availability` is that of the loop, from LoopChannels.
  CommandQueue(rt::CommandMailbox& box, const std::atomic<std::uint8_t>& availability,
               CommandCallbacks callbacks)
      : box_(box), standing_(availability), callbacks_(std::move(callbacks)) {}

  // Returns what the next command will find: the state of the loop after this sender's unanswered
  // commands.
  rt::LoopAvailability availability();
  bool has_room();
  // Does not wait. The lines are written when the answer arrives, with its result. Requires
  // `has_room()`. Returns the command's number.
  std::uint64_t send(rt::Command command, std::vector<journal::JournalEntry> lines);
  // Visits the unanswered commands, oldest first.
  template <class Visit>
  void for_each_waiting(Visit visit) const {
    for (const Waiting& waiting : waiting_) visit(waiting.command);
  }
  bool waiting() const noexcept { return !waiting_.empty(); }

  // Collects the available answers.
  void collect();
  // Call it after the loop has ended: unanswered commands are written as not taken.
  void close();
  // Returns nullopt for a command that is unanswered or no longer stored.
  std::optional<Outcome> outcome(std::uint64_t number);
  std::uint64_t newest() const noexcept { return newest_; }

 private:
  struct Waiting {
    rt::Command command;
    std::vector<journal::JournalEntry> lines;
  };
  std::uint64_t write_down(std::vector<journal::JournalEntry>& lines, const std::string& result);

  rt::CommandMailbox& box_;
  const std::atomic<std::uint8_t>& standing_;
  CommandCallbacks callbacks_;
  std::uint64_t newest_ = 0;
  // Lists, because most queues are empty: an empty deque has 576 bytes.
  std::list<Waiting> waiting_;
  std::list<Outcome> outcomes_;
};

}  // namespace loopwarden::daemon::commands
