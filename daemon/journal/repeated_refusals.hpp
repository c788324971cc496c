// SPDX-License-Identifier: Apache-2.0 Finds lines of refused commands that repeat, so that a master
// which repeats a refused command each second does not fill the journal. A repeated line says what
// the newest refusal of the same command to the same loop by the same peer said: same value, same
// reason, less than 30 s ago. A command that is done, another value or another reason ends the row.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "daemon/journal/journal_entry.hpp"

namespace loopwarden::daemon::journal {

// "10.0.0.7:40312" without its port; every other peer as it is.
std::string host_of(const std::string& peer);

class RepeatedRefusals {
 public:
  // To be asked once for each line, in their order.
  bool repeats(const JournalEntry& line);

 private:
  struct Refused {
    std::string value;
    std::string result;
    std::int64_t utc_ms = 0;
  };
  // By loop, alarm, command and host.
  using Command = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<Command, Refused> newest_;
};

}  // namespace loopwarden::daemon::journal
