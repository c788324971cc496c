// SPDX-License-Identifier: Apache-2.0
// What is known of every loop's valve, and what operators do with its alarms.
//
// The monitor writes, the control socket and the Modbus server read and act; all are ordinary threads,
// so a lock does. Every change of an alarm goes to the journal in the order in which it happened. Nobody waits here for
// the disk: who acts gets the journal's ticket, and tells whoever asked once that is on the disk, or that it is not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "daemon/journal/journal.hpp"
#include "daemon/supervision/alarm_order.hpp"
#include "daemon/supervision/explanation.hpp"
#include "daemon/supervision/window_log.hpp"
#include "model/analysis/condition_index.hpp"
#include "model/alarm/corrective_action.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/alarm/loop_incident.hpp"
#include "model/watch/mode_times.hpp"
#include "model/alarm/process_watch.hpp"
#include "model/watch/routine_watch.hpp"
#include "model/watch/twin_remarks.hpp"
#include "model/alarm/window_judge.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::daemon::supervision {

// What the monitor knows of one loop.
struct LoopWatch {
  LoopWatch(const alarm::AlarmSettings& settings, double period_s) noexcept
      : alarms(settings), times(period_s) {
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
      priority[index_of(kind)] = usual_priority(kind);
    }
  }

  alarm::LoopAlarms alarms;
  std::array<alarm::Priority, alarm::kAlarmKindCount> priority{};
  // How often the condition of a process alarm has come since it last was quiet.
  std::array<std::uint32_t, alarm::kAlarmKindCount> flaps{};
  alarm::LoopIncident incident;
  alarm::WindowState window_state = alarm::WindowState::filling;
  std::uint32_t windows = 0;             // looked at since the start
  std::uint32_t windows_suppressed = 0;  // of them, not fit to be judged
  alarm::WindowMeasures measures;        // of the newest window
  bool stick_seen = false;               // by the read-back, since the incident opened
  alarm::WindowJudgement judgement;      // of the newest window that was judged
  watch::ModeTimes times;
  loopwarden::analysis::ConditionIndices condition;
  alarm::CorrectiveState corrective = alarm::CorrectiveState::off;
  alarm::Veto veto = alarm::Veto::none;  // the operator's
  bool ordered =
      false;  // by a person: what corrective action offers; until the monitor has taken it
  // The newest of each alarm, by its name as it was raised, and of all. Copied with what they stand in: shared.
  std::array<std::shared_ptr<const Explanation>, alarm::kAlarmKindCount> explanations;
  std::shared_ptr<const Explanation> explanation;
  // What the loop's twin says beside its alarm; nothing: it has none.
  std::optional<watch::TwinRemarks> twin;
  std::string controller_not_watched;  // by the twin: why; empty: it is, or the loop runs here
  // What the source keeps of PV and CO, by the newest routine judgement.
  loopwarden::diagnosis::Archived source;
  double sees_from_percent = 0.0;  // % of the CO span
  watch::RoutineWatch::Levels routine{};
};

// The condition of a process alarm came or went; `why` is for the journal.
struct ProcessNews {
  alarm::ProcessChange change;
  std::string why;
};

using AlarmOrder = OrderOf<alarm::AlarmKind>;

// Alarms that were acknowledged together.
struct Acknowledged {
  struct Which {
    std::size_t loop = 0;
    alarm::AlarmKind kind = alarm::AlarmKind::stiction;
  };
  std::vector<Which> alarms;
  std::uint64_t ticket = 0;  // of the journal's last line; 0: no alarm waited
};

class WatchBoard {
 public:
  struct Loop {
    std::string name;
    double period_s = 0.1;  // s
    std::string pv_unit{};
    // Beside those that every loop has.
    std::vector<alarm::AlarmKind> fitted{};
    // Of an alarm that is not there: the usual one.
    std::map<alarm::AlarmKind, alarm::Priority> priority{};
  };
  // `utc_ms` gives the present time, ms since 1970.
  WatchBoard(std::vector<Loop> loops, const alarm::AlarmSettings& settings,
             journal::Journal& journal, std::function<std::int64_t()> utc_ms);
  WatchBoard(const WatchBoard&) = delete;
  WatchBoard& operator=(const WatchBoard&) = delete;

  // Before the threads start.
  void restore(const journal::AlarmStates& states);
  void restore(std::size_t loop, const Explanation& explanation);

  // --- the monitor ---
  // Returns the alarms whose condition came with this window.
  std::vector<alarm::AlarmKind> window_judged(std::size_t loop,
                                              const alarm::WindowMeasures& measures,
                                              const alarm::WindowJudgement& judgement,
                                              const alarm::AlarmConditions& conditions);
  // Minutes or hours were judged. Returns the alarms whose condition came with it.
  std::vector<alarm::AlarmKind> routine_judged(std::size_t loop,
                                               const watch::RoutineWatch::Judgement& judgement,
                                               const alarm::AlarmConditions& conditions);
  // The twin's watch changed its mind. Returns the alarms whose condition came with it.
  std::vector<alarm::AlarmKind> twin_judged(std::size_t loop,
                                            const alarm::AlarmConditions& conditions);
  // All of one cycle.
  void process_changed(std::size_t loop, std::span<const ProcessNews> news);
  void deviation_rests(std::size_t loop, bool rests);
  void pv_lost(std::size_t loop, bool lost);
  void set_flaps(std::size_t loop, const alarm::ProcessWatch& process);
  // It was found why an alarm came, for the first time or once more: the newest stands with the alarm and its incident, and may
  // give them another name. The journal has a line where that is another one.
  void explained(std::size_t loop, const Explanation& explanation);
  // A window that is full but can't be judged, or whose judgement says that it moves too little to tell.
  void window_not_fit(std::size_t loop, const alarm::WindowMeasures& measures,
                      alarm::WindowState why, const alarm::WindowJudgement& judgement = {});
  // No window can be had at present.
  void interrupted(std::size_t loop, alarm::WindowState why);
  // `state`: of the window that is being gathered; valid leaves that of the newest window.
  void set_progress(std::size_t loop, const watch::ModeTimes& times,
                    const loopwarden::analysis::ConditionIndices& condition,
                    alarm::WindowState state, const watch::RoutineWatch::Levels& routine = {});
  void controller_not_watched(std::size_t loop, std::string why);
  // What the twin says by now. `passed_s`: of the loop's time after the last call.
  void twin_says(std::size_t loop, const watch::TwinRemarks& remarks, double passed_s);
  // The newest window's stick is not that of the valve as it is by now.
  void stick_not_known(std::size_t loop);
  void pass_time();
  alarm::Veto veto(std::size_t loop) const;
  // Whether the stiction alarm is on, and the newest explanation of its incident where that has s and j; else null.
  struct Sticks {
    bool alarm = false;
    std::shared_ptr<const Explanation> explanation;
  };
  Sticks sticks(std::size_t loop) const;
  // A person has ordered what is offered; once.
  bool take_order(std::size_t loop);
  void corrective_state(std::size_t loop, alarm::CorrectiveState state);
  // Returns the journal's line, whose result is known once the loop has answered the order.
  journal::JournalEntry corrective_step(std::size_t loop, const alarm::CorrectiveStep& step);
  // Of a step without an order.
  void write_down(journal::JournalEntry line);

  // --- operators ---
  // Refused where the loop has no corrective action. Followed by the monitor within its round.
  OrderResult set_veto(std::size_t loop, alarm::Veto veto, const std::string& peer,
                       const std::string& reason);
  // Refused where corrective action offers nothing.
  OrderResult begin_offered(std::size_t loop, const std::string& peer, const std::string& reason);
  OrderResult act(std::size_t loop, const AlarmOrder& order);
  // Every alarm of the loop's incident that waits. Refused where that is another one, or where none waits.
  OrderResult acknowledge_incident(std::size_t loop, const std::string& id, const std::string& peer,
                                   const std::string& reason);
  // Every alarm of these kinds that waits, of every loop.
  Acknowledged acknowledge_all(std::span<const alarm::AlarmKind> kinds, const std::string& peer,
                               const std::string& reason);

  // Any thread.
  LoopWatch watch(std::size_t loop) const;
  // Without a copy; `look` must be quick, the monitor waits.
  template <class Look>
  void look(std::size_t loop, Look look) const {
    const std::lock_guard lock(mutex_);
    look(watches_[loop]);
  }
  std::vector<LoggedWindow> windows(std::size_t loop) const;
  // How often any alarm has changed since the start: whoever keeps the list asks for it again then.
  std::uint64_t alarm_changes() const;
  std::size_t loops() const noexcept { return names_.size(); }
  const std::string& name(std::size_t loop) const { return names_[loop]; }
  const alarm::AlarmSettings& settings() const noexcept { return settings_; }
  std::int64_t now_ms() const { return utc_ms_(); }

 private:
  using Memories = std::array<alarm::AlarmMemory, alarm::kAlarmKindCount>;
  Memories memories(std::size_t loop) const;
  void suppressed(std::size_t loop, alarm::WindowState why);
  // Journals what an event changed, with why, or why it is gone; returns the last ticket.
  std::uint64_t write_down(std::size_t loop, const Memories& before,
                           const alarm::AlarmTransitions& transitions, const std::string& why = {},
                           const std::string& why_gone = {},
                           std::span<const ProcessNews> news = {});
  void tell_explanation(std::size_t loop, const Explanation& explanation);
  // Journals what became of the loop's incident; returns the last ticket, 0 where nothing did.
  std::uint64_t follow_incident(std::size_t loop);
  std::uint64_t write_incident(std::size_t loop, const alarm::LoopIncident::Changes& changes);
  std::vector<alarm::AlarmKind> raised_since(std::size_t loop, const Memories& before) const;
  OrderResult act_locked(std::size_t loop, const AlarmOrder& order);

  std::vector<std::string> names_;
  std::vector<std::string> pv_units_;
  alarm::AlarmSettings settings_;
  journal::Journal& journal_;
  std::function<std::int64_t()> utc_ms_;
  mutable std::mutex mutex_;
  std::vector<LoopWatch> watches_;
  std::vector<WindowLog> logs_;
  std::vector<watch::TwinNews> twin_news_;
  std::uint64_t alarm_changes_ = 0;
};

}  // namespace loopwarden::daemon::supervision
