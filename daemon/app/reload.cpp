// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/app/reload_keys.hpp"
#include "daemon/rt/loop_settings.hpp"

namespace loopwarden::daemon::reload {
namespace {

using config::Configuration;
using config::DaemonConfig;
using config::LoopConfig;

constexpr const char* kWithIt = "waits together with a change of the meaning of the loop's numbers";

LoopPlan plan_of(const LoopConfig& running, const LoopConfig& wanted, const Output& output) {
  LoopPlan plan{.loop = wanted.name,
                .decision = Decision::apply,
                .keys = {.file = wanted.file, .applied = {}, .waiting_for_restart = {}},
                .file_hash = wanted.file_hash,
                .file_time_s = wanted.file_time_s,
                .waiting_for_output = {}};
  std::vector<Change>& waiting = plan.keys.waiting_for_restart;
  for (KeyChange& found : compare(running, wanted)) {
    if (found.effect == Effect::meaning) plan.decision = Decision::keep;
    (found.effect == Effect::applied ? plan.keys.applied : waiting)
        .push_back(std::move(found.change));
  }
  if (plan.decision == Decision::keep) {
    for (Change& change : plan.keys.applied) {
      change.why = kWithIt;
      waiting.push_back(std::move(change));
    }
    plan.keys.applied.clear();
  } else if (!rt::can_take_over(wanted.controller.output, running.controller.output, output.known,
                                output.value)) {
    hold(plan, why_held(wanted, output));
  }
  return plan;
}

constexpr const char* kNew = "the loop is new; it needs a restart";
constexpr const char* kMended =
    "the loop is out of service since the start; its files are good now, it needs a restart";
constexpr const char* kGone =
    "the loop is no longer in the files; it runs on unchanged until a restart";

LoopPlan plan_of(const LoopConfig& loop, Decision decision, const std::string& why) {
  return {.loop = loop.name,
          .decision = decision,
          .keys = {.file = loop.file,
                   .applied = {},
                   .waiting_for_restart = {{.key = "loop", .from = {}, .to = {}, .why = why}}},
          .file_hash = decision == Decision::came ? loop.file_hash : 0,
          .file_time_s = loop.file_time_s,
          .waiting_for_output = {}};
}

FilePlan plan_of(const DaemonConfig& running, const DaemonConfig& wanted) {
  FilePlan plan{.file = wanted.file, .applied = {}, .waiting_for_restart = {}};
  for (KeyChange& found : compare(running, wanted)) {
    (found.effect == Effect::applied ? plan.applied : plan.waiting_for_restart)
        .push_back(std::move(found.change));
  }
  return plan;
}

const LoopConfig* find(const Configuration& configuration, const std::string& name) {
  const auto& loops = configuration.loops;
  const auto found = std::find_if(loops.begin(), loops.end(),
                                  [&](const LoopConfig& loop) { return loop.name == name; });
  return found == loops.end() ? nullptr : &*found;
}

}  // namespace

const char* to_text(Decision decision) noexcept {
  switch (decision) {
    case Decision::apply: return "apply";
    case Decision::wait_for_output: return "wait_for_output";
    case Decision::keep: return "keep";
    case Decision::came: return "came";
    case Decision::gone: break;
  }
  return "gone";
}

bool Plan::all_in_force() const noexcept {
  return daemon.waiting_for_restart.empty() &&
         std::all_of(loops.begin(), loops.end(), [](const LoopPlan& loop) {
           return loop.decision == Decision::apply && loop.keys.waiting_for_restart.empty();
         });
}

Plan plan(const Configuration& running, const Configuration& wanted,
          std::span<const Output> outputs) {
  Plan plan{.daemon = plan_of(running.daemon, wanted.daemon), .loops = {}};
  for (const LoopConfig& loop : wanted.loops) {
    const LoopConfig* was = find(running, loop.name);
    if (was != nullptr && config::out_of_service(was->io) != nullptr) {
      plan.loops.push_back(plan_of(loop, Decision::came, kMended));
    } else if (was != nullptr) {
      const auto index = static_cast<std::size_t>(was - running.loops.data());
      plan.loops.push_back(plan_of(*was, loop, outputs[index]));
    } else {
      plan.loops.push_back(plan_of(loop, Decision::came, kNew));
    }
  }
  for (const LoopConfig& loop : running.loops) {
    if (find(wanted, loop.name) == nullptr) {
      plan.loops.push_back(plan_of(loop, Decision::gone, kGone));
    }
  }
  return plan;
}

Plan at_start(const Configuration& started) {
  Plan plan;
  for (const LoopConfig& loop : started.loops) {
    const std::string* why = config::out_of_service(loop.io);
    if (why == nullptr) continue;
    plan.loops.push_back(plan_of(loop, Decision::came, "the loop is out of service: " + *why));
  }
  return plan;
}

void apply(const DaemonConfig& wanted, DaemonConfig& running) {
  running.log_level = wanted.log_level;
  running.stop_timeout_s = wanted.stop_timeout_s;
  running.page = wanted.page;
  running.edge = wanted.edge;
}

void confirm(LoopPlan& loop) {
  loop.decision = Decision::apply;
  for (Change& change : loop.waiting_for_output) {
    change.why.clear();
    loop.keys.applied.push_back(std::move(change));
  }
  loop.waiting_for_output.clear();
}

void hold(LoopPlan& loop, const std::string& why) {
  loop.decision = Decision::wait_for_output;
  for (Change& change : loop.keys.applied) loop.waiting_for_output.push_back(std::move(change));
  loop.keys.applied.clear();
  for (Change& change : loop.waiting_for_output) change.why = why;
}

std::string why_held(const LoopConfig& wanted, const Output& output) {
  const control::OutputLimits& limits = wanted.controller.output;
  if (!output.known) {
    return fmt::format("until the output is known: the new limits [{}, {}] {} may exclude it",
                       limits.low, limits.high, wanted.co_unit);
  }
  return fmt::format("until CO, at {:.5g} {}, is inside the new limits [{}, {}] {}", output.value,
                     wanted.co_unit, limits.low, limits.high, wanted.co_unit);
}

}  // namespace loopwarden::daemon::reload
