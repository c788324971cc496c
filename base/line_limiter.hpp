// SPDX-License-Identifier: Apache-2.0
// Limits log lines about something that may change its state often, such as a link. For each
// subject and state it permits at most one line per kBetweenLines. Lines in between are counted.
// The log must end with the true state. If the newest withheld state differs from the newest
// written one, due() therefore returns its line as soon as permitted. No clock, no I/O. Not for
// several threads.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::base {

struct LimitedLine {
  bool good = true;  // info, otherwise a warning
  std::string text;
};

class LineLimiter {
 public:
  using Moment = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::minutes kBetweenLines{1};

  // Returns the line that may be written now, with the number of lines withheld before it.
  // The numbers of subjects and states must be bounded, because each is kept.
  std::optional<LimitedLine> take(const std::string& subject, const std::string& state,
                                  LimitedLine line, Moment now);
  // Returns the lines that were withheld, may be written now and are still true.
  std::vector<LimitedLine> due(Moment now);

 private:
  struct State {
    std::optional<Moment> written{};
    std::uint64_t withheld = 0;
  };
  struct Subject {
    std::map<std::string, State> states;
    std::string shown;  // state of the newest line that was written
    std::string newest;
    LimitedLine newest_line;
  };
  static LimitedLine write(Subject& subject, const std::string& name, State& state,
                           LimitedLine line, Moment now);

  std::map<std::string, Subject> subjects_;
};

}  // namespace loopwarden::base
