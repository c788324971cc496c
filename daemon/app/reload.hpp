// SPDX-License-Identifier: Apache-2.0
// What a reload does, said before it is done: `plan` compares the files of now with what runs.
//
// There is one baseline: what is in force, that is the files of the start with what reloads, and a
// Modbus master's gains, have changed since. What needs a restart never comes into force before it, so
// that for those keys the baseline is the start, and going back to the old files leaves nothing waiting.
//
// All or nothing for each loop. A key has one of three effects (the tables in reload_keys.cpp say which):
//   applied   tuning, limits, checks, safe actions: at once, between two cycles, without a bump
//   restart   counts at the next start and changes no number's meaning (description, start, recording,
//             monitor): waits by itself while the rest of its loop is applied
//   meaning   changes what other numbers of the loop mean, or which device they go to (units, ranges,
//             sample_time, io with its links and its model, valve_position): nothing of the loop is
//             applied before a restart
// Output limits that exclude CO wait, and with them all that would be applied of that loop, until CO
// is inside. The loop's cycle is the one that knows (rt::can_take_over); here it is foretold.
//
// A loop whose files had errors at the start stays out of service until a restart.
//
// Of loopwardend.yaml log_level, stop_timeout, page and edge are applied, everything else waits for a
// restart. A loop that came waits, one that is gone runs on as it is.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::reload {

// One key with another value than the one in force.
struct Change {
  std::string key;   // such as controller.kp, in the parallel form; "loop": one that came or went
  std::string from;  // both empty where a value has no short text
  std::string to;
  std::string why;  // it waits; empty where it does not

  friend bool operator==(const Change&, const Change&) = default;
};

enum class Decision : std::uint8_t {
  apply,
  wait_for_output,  // until CO is inside the new limits
  keep,             // nothing of the loop is applied before a restart
  came,
  gone
};
const char* to_text(Decision decision) noexcept;

struct FilePlan {
  std::string file;
  std::vector<Change> applied;
  std::vector<Change> waiting_for_restart;
};

struct LoopPlan {
  std::string loop;
  Decision decision = Decision::apply;
  FilePlan keys;
  std::uint32_t file_hash = 0;  // CRC-32 of the file's text as it was read for this plan; 0: gone
  std::vector<Change> waiting_for_output;
};

struct Plan {
  FilePlan daemon;
  std::vector<LoopPlan> loops;  // in the order of the files; those that are gone at the end

  bool all_in_force() const noexcept;
};

// Where the output of a running loop stands.
struct Output {
  bool known = false;
  double value = 0.0;  // CO units
};

// `outputs`: one for each loop that runs, in their order.
Plan plan(const config::Configuration& running, const config::Configuration& wanted,
          std::span<const Output> outputs);

// Right after the start: loops that are out of service wait for a restart.
Plan at_start(const config::Configuration& started);

// What a reload applies of loopwardend.yaml, put into what is in force.
void apply(const config::DaemonConfig& wanted, config::DaemonConfig& running);

// What the loop's cycle says: its settings are in force; they wait.
void confirm(LoopPlan& loop);
void hold(LoopPlan& loop, const std::string& why);
// Why limits wait.
std::string why_held(const config::LoopConfig& wanted, const Output& output);

// A line for each file and group of keys; none where nothing has another value.
std::vector<std::string> to_lines(const Plan& plan);
protocol::ReloadPlan told(const Plan& plan);
std::vector<protocol::Diagnostic> told(std::span<const config::Diagnostic> diagnostics);

}  // namespace loopwarden::daemon::reload
