// SPDX-License-Identifier: Apache-2.0
#include "base/line_limiter.hpp"

#include <utility>

namespace loopwarden::base {

std::optional<LimitedLine> LineLimiter::take(const std::string& subject, const std::string& state,
                                             LimitedLine line, Moment now) {
  Subject& about = subjects_[subject];
  State& one = about.states[state];
  about.newest = state;
  if (!one.written || now - *one.written >= kBetweenLines) {
    return write(about, state, one, std::move(line), now);
  }
  ++one.withheld;
  about.newest_line = std::move(line);
  return std::nullopt;
}

std::vector<LimitedLine> LineLimiter::due(Moment now) {
  std::vector<LimitedLine> lines;
  for (auto& [name, about] : subjects_) {
    if (about.newest == about.shown) continue;
    State& one = about.states[about.newest];
    if (now - *one.written < kBetweenLines) continue;
    --one.withheld;  // this one
    lines.push_back(write(about, about.newest, one, std::move(about.newest_line), now));
  }
  return lines;
}

LimitedLine LineLimiter::write(Subject& subject, const std::string& name, State& state,
                               LimitedLine line, Moment now) {
  state.written = now;
  subject.shown = name;
  if (const std::uint64_t more = std::exchange(state.withheld, 0); more > 0) {
    line.text += " (" + std::to_string(more) + " more such lines since the last one)";
  }
  return line;
}

}  // namespace loopwarden::base
