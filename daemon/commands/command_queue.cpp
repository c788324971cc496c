// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/command_queue.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::daemon::commands {

rt::LoopAvailability CommandQueue::availability() {
  collect();  // collected before the loop is read: it shows answered commands already
  rt::LoopAvailability availability = rt::unpacked(standing_.load(std::memory_order_acquire));
  for (const Waiting& waiting : waiting_) {
    availability.mode = waiting.command.mode.value_or(availability.mode);
    availability.output_known = availability.output_known || waiting.command.output.has_value();
  }
  return availability;
}

bool CommandQueue::has_room() {
  collect();
  return waiting_.size() < box_.commands.capacity();
}

std::uint64_t CommandQueue::send(rt::Command command, std::vector<journal::JournalEntry> lines) {
  command.number = ++newest_;
  waiting_.push_back({command, std::move(lines)});
  box_.commands.try_push(command);
  return command.number;
}

void CommandQueue::collect() {
  rt::CommandAnswer answer;
  while (box_.answers.try_pop(answer)) {
    // Answers arrive in the order of the commands.
    Waiting waiting = std::move(waiting_.front());
    waiting_.pop_front();
    Outcome outcome{.number = answer.number,
                    .refusal = answer.refusal,
                    .now = answer.now,
                    .why = {},
                    .answered = std::chrono::steady_clock::now()};
    if (answer.refusal != rt::Refusal::none) {
      outcome.why = callbacks_.why(answer, waiting.command);
    } else if (callbacks_.done && !waiting.lines.empty()) {
      callbacks_.done(waiting.command, waiting.lines.front());
    }
    outcome.journal_ticket =
        write_down(waiting.lines, outcome.why.empty() ? "done" : "refused: " + outcome.why);
    outcomes_.push_back(std::move(outcome));
    if (outcomes_.size() > kOutcomesKept) outcomes_.pop_front();
  }
}

void CommandQueue::close() {
  collect();
  for (Waiting& waiting : waiting_) {
    write_down(waiting.lines, "not taken: the daemon ended before the loop's next cycle");
  }
  waiting_.clear();
}

std::optional<Outcome> CommandQueue::outcome(std::uint64_t number) {
  collect();
  const auto found = std::find_if(outcomes_.begin(), outcomes_.end(),
                                  [&](const Outcome& o) { return o.number == number; });
  return found == outcomes_.end() ? std::nullopt : std::optional(*found);
}

std::uint64_t CommandQueue::write_down(std::vector<journal::JournalEntry>& lines,
                                       const std::string& result) {
  std::uint64_t ticket = 0;
  for (journal::JournalEntry& line : lines) {
    line.result = result;
    ticket = callbacks_.write_down(std::move(line));
  }
  return ticket;
}

}  // namespace loopwarden::daemon::commands
