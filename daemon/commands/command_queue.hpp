// SPDX-License-Identifier: Apache-2.0
// One sender's side of the orders to one loop: numbers them, knows what is on its way, and writes each into the
// journal with what the loop's cycle made of it.
//
// Used by the sender's thread alone.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/journal_entry.hpp"
#include "daemon/rt/command.hpp"

namespace loopwarden::daemon::commands {

// What became of an order.
struct Outcome {
  std::uint64_t number = 0;
  rt::Refusal refusal = rt::Refusal::none;
  rt::InForce now{};                 // as the cycle took it
  std::string why;                   // empty: it was done
  std::uint64_t journal_ticket = 0;  // of its last line
  std::chrono::steady_clock::time_point answered{};
};

struct CommandCallbacks {
  // Returns the journal's ticket.
  std::function<std::uint64_t(journal::JournalEntry)> write_down;
  std::function<std::string(const rt::CommandAnswer&, const rt::Command&)> why;
  // An order is in force; the first of its lines, before it is written.
  std::function<void(const rt::Command&, const journal::JournalEntry&)> done{};
};

class CommandQueue {
 public:
  static constexpr std::size_t kOutcomesKept = 64;

  // `standing` is the loop's, as LoopChannels has it.
  CommandQueue(rt::CommandMailbox& box, const std::atomic<std::uint8_t>& availability,
               CommandCallbacks callbacks)
      : box_(box), standing_(availability), callbacks_(std::move(callbacks)) {}

  // What the next order will find: the loop as it is, with this sender's orders that it has not taken yet.
  rt::LoopAvailability availability();
  bool has_room();
  // Nothing is waited for. The lines are written when the answer is there, with its result. `has_room()`
  // must be true. Returns the order's number.
  std::uint64_t send(rt::Command command, std::vector<journal::JournalEntry> lines);
  // Orders on their way, oldest first.
  template <class Visit>
  void for_each_waiting(Visit visit) const {
    for (const Waiting& waiting : waiting_) visit(waiting.command);
  }
  bool waiting() const noexcept { return !waiting_.empty(); }

  // Takes the answers that are there.
  void collect();
  // The loop has ended: what is not answered is written down as not taken.
  void close();
  // Nothing: on its way, or too long ago.
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
  std::deque<Waiting> waiting_;
  std::deque<Outcome> outcomes_;
};

}  // namespace loopwarden::daemon::commands
