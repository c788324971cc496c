// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/repeated_refusals.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <utility>

namespace loopwarden::daemon::journal {
namespace {

constexpr std::int64_t kHeld_ms = 30'000;
constexpr std::size_t kMostCommands = 4096;  // at this number, all are forgotten

}  // namespace

std::string host_of(const std::string& peer) {
  const std::size_t colon = peer.rfind(':');
  if (colon == std::string::npos) return peer;
  const bool is_port = std::all_of(peer.begin() + static_cast<std::ptrdiff_t>(colon) + 1,
                                   peer.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_port ? peer.substr(0, colon) : peer;
}

bool RepeatedRefusals::repeats(const JournalEntry& line) {
  using Kind = JournalEntry::Kind;
  if (line.kind != Kind::operator_action && line.kind != Kind::register_write) return false;
  Command command{line.loop, line.alarm, line.what, host_of(line.peer)};
  if (!line.result.starts_with("refused: ")) {
    newest_.erase(command);
    return false;
  }
  if (newest_.size() >= kMostCommands) newest_.clear();
  Refused now{.value = line.new_value, .result = line.result, .utc_ms = line.utc_ms};
  const auto [found, first] = newest_.try_emplace(std::move(command), now);
  if (first) return false;
  const Refused before = std::exchange(found->second, std::move(now));
  return before.value == found->second.value && before.result == found->second.result &&
         std::abs(found->second.utc_ms - before.utc_ms) < kHeld_ms;
}

}  // namespace loopwarden::daemon::journal
