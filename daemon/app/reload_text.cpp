// SPDX-License-Identifier: Apache-2.0
// Formats a plan as text and as an answer of the sockets.
#include <fmt/format.h>

#include <utility>

#include "daemon/app/reload.hpp"
#include "daemon/app/reload_keys.hpp"

namespace loopwarden::daemon::reload {
namespace {

std::string text_of(const Change& change) {
  if (change.from.empty()) return change.key;
  return fmt::format("{} {} -> {}", change.key, change.from, change.to);
}

std::string text_of(const std::vector<Change>& changes) {
  std::vector<std::string> texts;
  for (const Change& change : changes) texts.push_back(text_of(change));
  return fmt::format("{}", fmt::join(texts, ", "));
}

void add_lines(const std::string& name, const FilePlan& keys, std::vector<std::string>& lines) {
  if (!keys.applied.empty()) {
    lines.push_back(fmt::format("{}: applied: {}", name, text_of(keys.applied)));
  }
  if (!keys.waiting_for_restart.empty()) {
    lines.push_back(
        fmt::format("{}: waits for a restart: {}", name, text_of(keys.waiting_for_restart)));
  }
}

std::string kept_line(const LoopPlan& loop) {
  std::vector<Change> meaning;
  std::vector<Change> with_it;
  for (const Change& change : loop.keys.waiting_for_restart) {
    (change.why == kMeaning ? meaning : with_it).push_back(change);
  }
  std::string line = fmt::format(
      "{}: all changes wait for a restart, because these change the meaning of its numbers: {}",
      loop.loop, text_of(meaning));
  if (!with_it.empty()) line += "; also waiting: " + text_of(with_it);
  return line;
}

std::vector<protocol::KeyChange> told(const std::vector<Change>& changes) {
  std::vector<protocol::KeyChange> all;
  for (const Change& change : changes) {
    protocol::KeyChange one{.key = change.key};
    if (!change.from.empty()) {
      one.from = change.from;
      one.to = change.to;
    }
    if (!change.why.empty()) one.why = change.why;
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace

std::vector<std::string> to_lines(const Plan& plan) {
  std::vector<std::string> lines;
  add_lines(plan.daemon.file, plan.daemon, lines);
  for (const LoopPlan& loop : plan.loops) {
    switch (loop.decision) {
      case Decision::keep: lines.push_back(kept_line(loop)); break;
      case Decision::came:
      case Decision::gone:
        lines.push_back(fmt::format("{}: {}", loop.loop, loop.keys.waiting_for_restart[0].why));
        break;
      case Decision::apply:
      case Decision::wait_for_output:
        add_lines(loop.loop, loop.keys, lines);
        if (!loop.waiting_for_output.empty()) {
          lines.push_back(fmt::format("{}: waits {}: {}", loop.loop, loop.waiting_for_output[0].why,
                                      text_of(loop.waiting_for_output)));
        }
    }
  }
  return lines;
}

protocol::ReloadPlan told(const Plan& plan) {
  protocol::ReloadPlan all{
      .daemon = {.file = plan.daemon.file,
                 .applied = told(plan.daemon.applied),
                 .waiting_for_restart = told(plan.daemon.waiting_for_restart)}};
  for (const LoopPlan& loop : plan.loops) {
    all.loops.push_back({.loop = loop.loop,
                         .file = loop.keys.file,
                         .decision = to_text(loop.decision),
                         .file_hash = loop.file_hash,
                         .file_time_s = loop.file_time_s,
                         .applied = told(loop.keys.applied),
                         .waiting_for_output = told(loop.waiting_for_output),
                         .waiting_for_restart = told(loop.keys.waiting_for_restart)});
  }
  return all;
}

std::vector<protocol::Diagnostic> told(std::span<const config::Diagnostic> diagnostics) {
  std::vector<protocol::Diagnostic> all;
  for (const config::Diagnostic& d : diagnostics) {
    all.push_back({.file = d.file,
                   .level = d.level == config::Diagnostic::Level::error ? "error" : "warning",
                   .key = d.key,
                   .message = d.message,
                   .line = d.place.line,
                   .column = d.place.column});
  }
  return all;
}

}  // namespace loopwarden::daemon::reload
