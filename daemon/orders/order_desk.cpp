// SPDX-License-Identifier: Apache-2.0
#include "daemon/orders/order_desk.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::daemon::orders {

rt::Standing OrderDesk::standing() {
  collect();  // collected before the loop is read: it shows answered orders already
  rt::Standing standing = rt::unpacked(standing_.load(std::memory_order_acquire));
  for (const Waiting& waiting : waiting_) {
    standing.mode = waiting.order.mode.value_or(standing.mode);
    standing.output_known = standing.output_known || waiting.order.output.has_value();
  }
  return standing;
}

bool OrderDesk::has_room() {
  collect();
  return waiting_.size() < box_.orders.capacity();
}

std::uint64_t OrderDesk::send(rt::Order order, std::vector<journal::JournalEntry> lines) {
  order.number = ++newest_;
  waiting_.push_back({order, std::move(lines)});
  box_.orders.try_push(order);
  return order.number;
}

void OrderDesk::collect() {
  rt::OrderAnswer answer;
  while (box_.answers.try_pop(answer)) {
    // Answers arrive in the sequence of the orders.
    Waiting waiting = std::move(waiting_.front());
    waiting_.pop_front();
    Outcome outcome{.number = answer.number,
                    .refusal = answer.refusal,
                    .now = answer.now,
                    .why = {},
                    .answered = std::chrono::steady_clock::now()};
    if (answer.refusal != rt::Refusal::none) {
      outcome.why = ends_.why(answer, waiting.order);
    } else if (ends_.done && !waiting.lines.empty()) {
      ends_.done(waiting.order, waiting.lines.front());
    }
    outcome.journal_ticket =
        write_down(waiting.lines, outcome.why.empty() ? "done" : "refused: " + outcome.why);
    outcomes_.push_back(std::move(outcome));
    if (outcomes_.size() > kOutcomesKept) outcomes_.pop_front();
  }
}

void OrderDesk::close() {
  collect();
  for (Waiting& waiting : waiting_) {
    write_down(waiting.lines, "not taken: the daemon ended before the loop's next cycle");
  }
  waiting_.clear();
}

std::optional<Outcome> OrderDesk::outcome(std::uint64_t number) {
  collect();
  const auto found = std::find_if(outcomes_.begin(), outcomes_.end(),
                                  [&](const Outcome& o) { return o.number == number; });
  return found == outcomes_.end() ? std::nullopt : std::optional(*found);
}

std::uint64_t OrderDesk::write_down(std::vector<journal::JournalEntry>& lines,
                                    const std::string& result) {
  std::uint64_t ticket = 0;
  for (journal::JournalEntry& line : lines) {
    line.result = result;
    ticket = ends_.write_down(std::move(line));
  }
  return ticket;
}

}  // namespace loopwarden::daemon::orders
