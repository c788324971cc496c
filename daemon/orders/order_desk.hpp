// SPDX-License-Identifier: Apache-2.0
// One sender's side of the orders to one loop. It numbers the orders, tracks the unanswered ones,
// and writes each order to the journal with the result from the loop's cycle.
//
// For the sender's thread only.
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
#include "daemon/rt/order.hpp"

namespace loopwarden::daemon::orders {

// The result of an order.
struct Outcome {
  std::uint64_t number = 0;
  rt::Refusal refusal = rt::Refusal::none;
  rt::InForce now{};                 // values when the cycle took it
  std::string why;                   // empty: the order was done
  std::uint64_t journal_ticket = 0;  // of its last line
  std::chrono::steady_clock::time_point answered{};
};

struct DeskEnds {
  // Writes a line and returns the journal's ticket.
  std::function<std::uint64_t(journal::JournalEntry)> write_down;
  std::function<std::string(const rt::OrderAnswer&, const rt::Order&)> why;
  // Called when an order is in force, with the first of its lines before that is written.
  std::function<void(const rt::Order&, const journal::JournalEntry&)> done{};
};

class OrderDesk {
 public:
  static constexpr std::size_t kOutcomesKept = 64;

  // `standing`: that of the loop in LoopChannels.
  OrderDesk(rt::OrderBox& box, const std::atomic<std::uint8_t>& standing, DeskEnds ends)
      : box_(box), standing_(standing), ends_(std::move(ends)) {}

  // Returns the state that the next order will find: the loop's, changed by this sender's orders
  // that the loop has not taken yet.
  rt::Standing standing();
  bool has_room();
  // Sends an order without waiting. The lines are written with the result when the answer arrives.
  // `has_room()` must be true. Returns the order's number.
  std::uint64_t send(rt::Order order, std::vector<journal::JournalEntry> lines);
  // Calls `visit` for the unanswered orders, oldest first.
  template <class Visit>
  void for_each_waiting(Visit visit) const {
    for (const Waiting& waiting : waiting_) visit(waiting.order);
  }
  bool waiting() const noexcept { return !waiting_.empty(); }

  // Collects the available answers.
  void collect();
  // Call it after the loop has ended: unanswered orders are written as not taken.
  void close();
  // Returns nullopt for an order that is unanswered or no longer stored.
  std::optional<Outcome> outcome(std::uint64_t number);
  std::uint64_t newest() const noexcept { return newest_; }

 private:
  struct Waiting {
    rt::Order order;
    std::vector<journal::JournalEntry> lines;
  };
  std::uint64_t write_down(std::vector<journal::JournalEntry>& lines, const std::string& result);

  rt::OrderBox& box_;
  const std::atomic<std::uint8_t>& standing_;
  DeskEnds ends_;
  std::uint64_t newest_ = 0;
  std::deque<Waiting> waiting_;
  std::deque<Outcome> outcomes_;
};

}  // namespace loopwarden::daemon::orders
