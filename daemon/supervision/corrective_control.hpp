// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/newest_value.hpp"
#include "daemon/commands/command_queue.hpp"
#include "daemon/rt/planned_moves_status.hpp"
#include "daemon/supervision/journaled_alarms.hpp"
#include "model/alarm/corrective_action.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::daemon::supervision {

// Access of the corrective action to its loop.
struct CorrectiveChannels {
  // Queue for commands of jacket and planned moves. Null: the loop has no corrective action.
  commands::CommandQueue* commands = nullptr;
  const std::atomic<std::uint32_t>* settings_taken = nullptr;  // set if `commands` is set
  const std::atomic<bool>* commissioned = nullptr;             // set if `commands` is set
  // Set if the corrective action has planned moves.
  base::NewestValue<control::PlannedMovesSettings>* moves_settings = nullptr;
  const rt::PlannedMovesStatus* moves = nullptr;
  bool hardware = false;  // the loop moves a real valve
};

// Runs the corrective action of one loop: follows its alarms, its operator and its cycle, and
// switches the jacket or planned moves. Used by the monitor's thread only.
class CorrectiveControl {
 public:
  // `twin`: null for a loop without twin; read during construction only.
  CorrectiveControl(const alarm::CorrectiveSettings& settings, const CorrectiveChannels& channels,
                    const plant::LoopModel* twin, double period_s, JournaledAlarms& alarms);

  // Takes the answer to the last command, reloads, vetoes, explanations and the operator's command.
  void attend();
  // `raised`: the step raised the stiction alarm.
  void follow_step(const watch::MonitorStep& step, bool raised);
  // `cycles`: number of cycles since the last call.
  void follow_moves(std::size_t cycles);
  // Records every command without an answer as not taken.
  void close();
  bool suppresses_cycling() const noexcept { return action_.calms(); }

 private:
  struct PlannedMoves {
    bool on_order;
    // Nothing if the process allows no planned moves.
    std::optional<control::PlannedMovesSettings> settings;
    std::shared_ptr<const Explanation> explained;  // newest one that was evaluated
  };
  static std::optional<PlannedMoves> planned_moves_of(const alarm::CorrectiveSettings& settings,
                                                      const CorrectiveChannels& channels,
                                                      const plant::LoopModel* twin);
  void follow_explanation();
  void follow(const alarm::CorrectiveStep& step);
  journal::JournalEntry line_of(const alarm::CorrectiveStep& step) const;
  rt::Command command_of(const alarm::CorrectiveStep& step) const;

  CorrectiveChannels channels_;
  double period_s_;
  JournaledAlarms& alarms_;
  alarm::CorrectiveAction action_;
  std::optional<PlannedMoves> planned_;  // set if the corrective action has this form
  std::uint32_t settings_seen_;
  std::uint64_t command_ = 0;  // newest command that waits for its answer; 0: no command
  bool alarm_raised_ = false;  // the action has not been notified yet
  // Alarms that were raised earlier begin no planned moves without an operator.
  std::int64_t started_ms_;
};

}  // namespace loopwarden::daemon::supervision
