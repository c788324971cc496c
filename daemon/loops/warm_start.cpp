// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/warm_start.hpp"

#include <fmt/format.h>

#include <utility>

namespace loopwarden::daemon {
namespace {

using config::Start;
using control::Mode;

std::string text_of(Mode mode, double set_point, const std::string& unit) {
  return fmt::format("{}, SP {:.9g} {}", control::to_text(mode), set_point, unit);
}

const char* word_of(Start::AfterRestart after) noexcept {
  switch (after) {
    case Start::AfterRestart::resume: return "continue";
    case Start::AfterRestart::manual: return "manual";
    case Start::AfterRestart::file: break;
  }
  return "file";
}

// Returns why a loop can't continue with the last set point; empty: its unit and range are
// unchanged and its limits allow it.
std::string why_not_set_point(const config::LoopConfig& loop, const LastCommand& last) {
  const std::pair<double, double> range{loop.pv.low, loop.pv.high};
  if (last.pv_unit != loop.pv_unit || last.pv_range != range) {
    return fmt::format("PV was in {:g} to {:g} {} before, and is in {:g} to {:g} {}",
                       last.pv_range.first, last.pv_range.second, last.pv_unit, range.first,
                       range.second, loop.pv_unit);
  }
  const control::SetPointLimits& limits = loop.controller.set_point;
  if (last.set_point >= limits.low && last.set_point <= limits.high) return {};
  return fmt::format("set point {:.9g} is outside its limits {:g} to {:g}", last.set_point,
                     limits.low, limits.high);
}

// Returns why a loop that was in automatic must wait in manual; empty: it need not.
std::string why_manual(const config::LoopConfig& loop, const LastCommand& last) {
  if (last.commissioned) return "the loop was being commissioned";
  if (last.manual_after_fault) return "the loop had a fault after which it waits in manual";
  if (!loop.start.output_is_told) return "the position of the output is unknown";
  return why_not_set_point(loop, last);
}

}  // namespace

WarmStart warm_start(const config::LoopConfig& loop, const LastCommands& commands) {
  const Start& file = loop.start;
  WarmStart warm{.start = {file.mode, file.set_point, file.output}, .line = std::nullopt};
  if (config::out_of_service(loop.io) != nullptr) return warm;
  rt::StartSettings& start = warm.start;
  std::string before = "not known";
  std::string reason = fmt::format("start.after_restart is {}", word_of(file.after_restart));
  const auto found = commands.loops.find(loop.name);
  if (found != commands.loops.end()) {
    const LastCommand& last = found->second;
    before = text_of(last.mode, last.set_point, last.pv_unit);
    if (file.after_restart != Start::AfterRestart::file) {
      start.mode = Mode::manual;
      if (why_not_set_point(loop, last).empty()) start.set_point = last.set_point;
    }
    if (file.after_restart == Start::AfterRestart::resume && last.mode == Mode::automatic) {
      const std::string why = why_manual(loop, last);
      if (why.empty()) start.mode = Mode::automatic;
      if (!why.empty()) reason += ", but " + why + ": the loop waits in manual";
    }
    const bool as_before = start.mode == last.mode && start.set_point == last.set_point;
    const bool as_file = start.mode == file.mode && start.set_point == file.set_point;
    if (as_before && as_file) return warm;
  } else if (!commands.damaged.empty()) {
    if (file.after_restart != Start::AfterRestart::file) start.mode = Mode::manual;
    reason += "; the last orders are not known: " + commands.damaged;
  } else if (commands.known) {
    reason += ", and no order to this loop is known";
  } else {
    return warm;
  }
  journal::JournalEntry& line = warm.line.emplace();
  line.kind = journal::JournalEntry::Kind::system;
  line.loop = loop.name;
  line.what = "restart";
  line.old_value = std::move(before);
  line.new_value = text_of(start.mode, start.set_point, loop.pv_unit);
  line.result = "done";
  line.reason =
      fmt::format("{}; the file has {}", reason, text_of(file.mode, file.set_point, loop.pv_unit));
  return warm;
}

}  // namespace loopwarden::daemon
