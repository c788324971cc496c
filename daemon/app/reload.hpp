// SPDX-License-Identifier: Apache-2.0
// Plans a reload before it is carried out: `plan` compares the present files with the configuration
// in force.
//
// The baseline is the configuration in force: the files of the start, changed by reloads and by
// gains from a Modbus master. Keys that need a restart stay at their values of the start. If the
// old files are restored, no change waits.
//
// Each loop is reloaded completely or not at all. A key has one of three effects (tables in
// reload_keys.cpp):
//   applied   tuning, limits, checks, safe actions: at once, between two cycles, without a bump
//   restart   applies at the next start and changes the meaning of no number (description, start,
//             recording, monitor): waits, while the other changes of its loop are applied
//   meaning   changes the meaning of other numbers of the loop, or the device that they go to
//             (units, ranges, sample_time, io with its links and its model, valve_position): blocks
//             all changes of the loop until a restart
// Output limits that exclude CO wait until CO is inside, together with the loop's other changes.
// The loop's cycle decides that (rt::can_take_over); the plan only predicts it.
//
// A loop whose files had errors at the start stays out of service until a restart.
//
// In loopwardend.yaml, log_level, stop_timeout, page and edge are applied. All other keys wait for
// a restart. A new loop waits for a restart. A removed loop runs on unchanged.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::reload {

// A key whose value differs from the one in force.
struct Change {
  std::string key;   // such as controller.kp, in the parallel form; "loop": a new or removed loop
  std::string from;  // both empty if a value has no short text
  std::string to;
  std::string why;  // why it waits; empty: it does not wait

  friend bool operator==(const Change&, const Change&) = default;
};

enum class Decision : std::uint8_t {
  apply,
  wait_for_output,  // until CO is inside the new limits
  keep,             // changes of the loop wait for a restart
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
  // CRC-32 of the text of the file that this plan was made from; 0: the file is gone
  std::uint32_t file_hash = 0;
  std::int64_t file_time_s = 0;  // last change of the file, s since 1970
  std::vector<Change> waiting_for_output;
};

struct Plan {
  FilePlan daemon;
  std::vector<LoopPlan> loops;  // in the order of the files; removed loops at the end

  bool all_in_force() const noexcept;
};

// The output of a running loop.
struct Output {
  bool known = false;
  double value = 0.0;  // CO units
};

// Makes the plan. `outputs`: one per running loop, in their order.
Plan plan(const config::Configuration& running, const config::Configuration& wanted,
          std::span<const Output> outputs);

// Returns the plan right after the start: loops out of service wait for a restart.
Plan at_start(const config::Configuration& started);

// Copies the keys of loopwardend.yaml that a reload applies into the configuration in force.
void apply(const config::DaemonConfig& wanted, config::DaemonConfig& running);

// Update the plan with the cycle's report: the loop's settings are in force, or they wait.
void confirm(LoopPlan& loop);
void hold(LoopPlan& loop, const std::string& why);
// Returns why limits wait.
std::string why_held(const config::LoopConfig& wanted, const Output& output);

// Returns one line per file and group of keys; empty if no value differs.
std::vector<std::string> to_lines(const Plan& plan);
protocol::ReloadPlan told(const Plan& plan);
std::vector<protocol::Diagnostic> told(std::span<const config::Diagnostic> diagnostics);

}  // namespace loopwarden::daemon::reload
