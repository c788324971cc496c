// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "daemon/console/journal_answer.hpp"
#include "daemon/console/operations.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/commands/command_queue.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Sends operators' commands to the loops: `set`, `tune`, and `order` for the result of either. The
// only writer of the loops' operator commands. All functions throw RequestError with the reason of
// a refusal, which the journal has too.
class LoopCommands {
 public:
  LoopCommands(const Plant& plant, journal::Journal& journal, const Operations& operations,
               Worked worked)
      : plant_(plant), journal_(journal), operations_(operations), worked_(std::move(worked)) {}
  LoopCommands(const LoopCommands&) = delete;
  LoopCommands& operator=(const LoopCommands&) = delete;

  protocol::OrderTaken set(const protocol::SetRequest& request, const Sender& sender);
  protocol::OrderTaken tune(const protocol::TuneRequest& request, const Sender& sender);
  protocol::OrderState order(const protocol::OrderRequest& request);

  // Queues a command of this peer for the loop. `text`: the command as it was given, for the log.
  protocol::OrderTaken send(std::size_t loop, const rt::Command& command, const std::string& peer,
                            const std::string& text);
  // Returns why a command would be refused now; empty if it would be accepted.
  std::string refusal_of(std::size_t loop, const rt::Command& command);
  commands::CommandQueue& queue(std::size_t loop);

  // Receives the answers of the loops.
  void collect();
  // Records every command without an answer as not taken, because the loops have ended.
  void close();

 private:
  using Lines = std::vector<journal::JournalEntry>;
  protocol::OrderTaken send(std::size_t loop, const rt::Command& command, Lines lines,
                            const std::string& peer, const std::string& text);
  // Returns a line per part of the command, without the results.
  Lines lines_of(const rt::Command& command, std::size_t loop, const std::string& peer) const;

  Plant plant_;
  journal::Journal& journal_;
  const Operations& operations_;
  Worked worked_;
  std::deque<commands::CommandQueue> queues_;  // one per loop, created before the first command
};

}  // namespace loopwarden::daemon::console
