// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "daemon/journal/journal.hpp"
#include "daemon/supervision/alarm_command.hpp"
#include "daemon/supervision/alarm_snapshot.hpp"
#include "daemon/supervision/explanation.hpp"
#include "daemon/supervision/window_log.hpp"
#include "model/alarm/process_watch.hpp"

namespace loopwarden::daemon::supervision {

// Configuration of one supervised loop.
struct SupervisedLoop {
  std::string name;
  double period_s = 0.1;
  std::string pv_unit{};
  // Process alarms in addition to those that every loop has.
  std::vector<alarm::AlarmKind> fitted{};
  // Alarms without an entry have their usual priority.
  std::map<alarm::AlarmKind, alarm::Priority> priority{};
};

// A changed condition of a process alarm; `why` is for the journal.
struct ProcessNews {
  alarm::ProcessChange change;
  std::string why;
};

using AlarmCommand = AlarmCommandOf<alarm::AlarmKind>;

// The alarms, the incident and the explanations of one loop. Each change gets a line in the
// journal, in the order of the changes. Any thread; no function waits for the disk: actions return
// the journal's ticket, with which the caller waits.
class JournaledAlarms {
 public:
  using AlarmKinds = std::vector<alarm::AlarmKind>;

  // `utc_ms` returns the present time, ms since 1970.
  JournaledAlarms(SupervisedLoop loop, const alarm::AlarmSettings& settings,
                  journal::Journal& journal, std::function<std::int64_t()> utc_ms);
  JournaledAlarms(const JournaledAlarms&) = delete;
  JournaledAlarms& operator=(const JournaledAlarms&) = delete;

  // Restores the state before a restart. Call before the threads start.
  void restore(const journal::AlarmStates& states);
  // Stores an explanation that the journal has already: after a restart, or with a new state of its
  // slip.
  void restore(const Explanation& explanation);

  // --- results of the detectors ---
  // Each returns the alarms that the result raised.
  AlarmKinds window_judged(const alarm::WindowMeasures& measures,
                           const alarm::WindowJudgement& judgement,
                           const alarm::AlarmConditions& conditions);
  AlarmKinds routine_judged(const watch::RoutineWatch::Judgement& judgement,
                            const alarm::AlarmConditions& conditions);
  AlarmKinds twin_judged(const alarm::AlarmConditions& conditions);
  // `news`: all changes of one cycle.
  void process_changed(std::span<const ProcessNews> news);
  void deviation_rests(bool rests);
  void pv_lost(bool lost);
  void set_pv_silence(base::Reason reason);
  // `alarm`: the box's alarm that stands for the loss of the loop's connection; empty: none. After
  // its end the alarms that follow from it stay suppressed while they clear. An alarm that is still
  // present then is the loop's own after the on-delay.
  void behind_outage(std::string alarm);
  void set_conditions(const alarm::ProcessWatch& process);
  // A full window could not be judged, or its judgement reports too little movement.
  void window_not_fit(const alarm::WindowMeasures& measures, alarm::WindowState why,
                      const alarm::WindowJudgement& judgement = {});
  // No window can be gathered at present.
  void interrupted(alarm::WindowState why);
  // `state`: of the window that is being gathered; valid keeps the state of the newest window.
  void set_progress(const watch::ModeTimes& times, const analysis::ConditionIndices& condition,
                    alarm::WindowState state, const watch::RoutineWatch::Levels& routine = {});
  void controller_not_watched(std::string why);
  // `passed_s`: time of the loop since the last call.
  void set_twin_remarks(const watch::TwinRemarks& remarks, double passed_s);
  // The valve has changed after the stick of the newest window was measured.
  void forget_stick();
  void pass_time();
  // Stores an explanation, also a repeated one. It may rename the alarm and its incident. The
  // journal gets a line if it differs from the one before.
  void explained(const Explanation& explanation);

  // --- corrective action ---
  alarm::Veto veto() const;
  // True if the stiction alarm is on and no consequence of another alarm.
  bool stiction_is_on() const;
  struct Sticks {
    bool alarm = false;                              // as stiction_is_on()
    std::shared_ptr<const Explanation> explanation;  // newest of the incident, if it has s and j
  };
  Sticks sticks() const;
  // Returns true once after an operator began the offered action.
  bool take_begin_request();
  void set_corrective_state(alarm::CorrectiveState state);

  // --- operators ---
  // Refused if the loop has no corrective action. The supervisor obeys in its next turn.
  CommandResult set_veto(alarm::Veto veto, const std::string& peer, const std::string& reason);
  // Refused unless corrective action offers an action.
  CommandResult begin_offered(const std::string& peer, const std::string& reason);
  CommandResult act(const AlarmCommand& command);
  // Acknowledges all alarms of incident `id`. Refused if the newest incident has another id, or if
  // no alarm of it is unacknowledged.
  CommandResult acknowledge_incident(const std::string& id, const std::string& peer,
                                     const std::string& reason);
  // Acknowledges all unacknowledged alarms of `kinds` and adds them to `acknowledged`. Returns the
  // ticket of the journal's last line; 0 without a line.
  std::uint64_t acknowledge(std::span<const alarm::AlarmKind> kinds, const std::string& peer,
                            const std::string& reason, AlarmKinds& acknowledged);

  // --- readers ---
  AlarmSnapshot snapshot() const;
  // Passes the state to `look` without a copy. `look` must be quick, because the monitor waits.
  template <class Look>
  void look(Look look) const {
    const std::lock_guard lock(mutex_);
    look(snapshot_);
  }
  std::vector<LoggedWindow> windows() const;
  // Number of changes of alarms since the start.
  std::uint64_t changes() const;
  const std::string& name() const noexcept { return name_; }
  std::int64_t now_ms() const { return utc_ms_(); }
  std::uint64_t post(journal::JournalEntry line);

 private:
  using Memories = std::array<alarm::AlarmMemory, alarm::kAlarmKindCount>;
  Memories memories() const;
  void keep(const Explanation& explanation);
  void take_measures(const alarm::WindowMeasures& measures);
  // False for an explanation of an earlier incident that ended late.
  bool of_incident(const Explanation& explanation) const;
  bool after_outage(const Memories& before);
  void suppressed(alarm::WindowState why);
  // Journals the changes of an event, with the reason for a raised or a cleared alarm. Returns the
  // ticket of the last line.
  std::uint64_t write_down(const Memories& before, const alarm::AlarmTransitions& transitions,
                           const std::string& why = {}, const std::string& why_gone = {},
                           std::span<const ProcessNews> news = {});
  void journal_explanation(const Explanation& explanation);
  // Journals the changes of the incident. Returns the ticket of the last line; 0 without a change.
  std::uint64_t follow_incident();
  std::uint64_t write_incident(const alarm::LoopIncident::Changes& changes);
  AlarmKinds raised_since(const Memories& before) const;
  CommandResult act_locked(const AlarmCommand& command);

  std::string name_;
  std::string pv_unit_;
  journal::Journal& journal_;
  std::function<std::int64_t()> utc_ms_;
  mutable std::mutex mutex_;
  AlarmSnapshot snapshot_;
  WindowLog windows_;
  watch::TwinNews twin_news_;
  std::int64_t pv_back_ms_ = 0;                       // when PV was last not silent any more
  std::array<bool, alarm::kAlarmKindCount> there_{};  // process alarms that the newest cycle shows
  std::uint64_t changes_ = 0;
};

}  // namespace loopwarden::daemon::supervision
