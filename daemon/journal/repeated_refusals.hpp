// SPDX-License-Identifier: Apache-2.0
// Finds repeated refusals, so that a master that repeats a refused command each second does not
// fill the journal. A line is a repeat if the newest refusal of the same command to the same loop
// by the same peer is less than 30 s old. Its value and reason must be the same. A command that is
// done, another value or another reason ends the series.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "daemon/journal/journal_entry.hpp"

namespace loopwarden::daemon::journal {

// Returns "10.0.0.7:40312" without its port, and every other peer unchanged.
std::string host_of(const std::string& peer);

class RepeatedRefusals {
 public:
  // Returns whether the line is a repeat. Call it once per line, in their order.
  bool repeats(const JournalEntry& line);

 private:
  struct Refused {
    std::string value;
    std::string result;
    std::int64_t utc_ms = 0;
  };
  // Loop, alarm, command and host.
  using Command = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<Command, Refused> newest_;
};

}  // namespace loopwarden::daemon::journal
