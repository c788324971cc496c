// SPDX-License-Identifier: Apache-2.0
// Journal lines of operators' commands, and answers that wait until a line is on the disk.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "base/local_server.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/journal/journal.hpp"

namespace loopwarden::daemon::console {

// Longest time for which an answer waits for the disk; other requests are served meanwhile.
inline constexpr std::chrono::milliseconds kDiskPatience{1000};
inline constexpr std::chrono::milliseconds kLimitedDiskPatience{250};  // page.sock, edge.sock

// Is called after work at a loop that a receipt can judge: new gains, a reported repair or a
// reported change.
using Worked = std::function<void(std::size_t loop, const std::string& peer)>;

// Returns a line for the command of an operator, without its result.
inline journal::JournalEntry operator_line(const Plant& plant, std::size_t loop,
                                           const std::string& peer) {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = plant.alarms.now_ms();
  line.loop = plant.alarms.name(loop);
  line.peer = peer;
  return line;
}

// Returns `reply` with "on_disk", as soon as the journal has the line of `ticket` on the disk or
// the patience for this sender is over.
template <class Reply>
base::LocalServer::Answer when_written(const journal::Journal& journal, Reply reply,
                                       std::uint64_t ticket, const Sender& sender) {
  using Clock = std::chrono::steady_clock;
  const auto patience = sender.socket == SocketName::control ? kDiskPatience : kLimitedDiskPatience;
  return [&journal, reply = std::move(reply), ticket,
          until = Clock::now() + patience]() mutable -> std::optional<std::string> {
    const journal::Written written = journal.written(ticket);
    if (written == journal::Written::not_yet && Clock::now() < until) return std::nullopt;
    reply.on_disk = written == journal::Written::yes;
    return done(reply);
  };
}

}  // namespace loopwarden::daemon::console
