// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/spsc_ring.hpp"
#include "daemon/supervision/corrective_control.hpp"
#include "daemon/supervision/history.hpp"
#include "daemon/supervision/journaled_alarms.hpp"
#include "daemon/supervision/moves_planning.hpp"
#include "model/watch/condition_watch.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/watch/mode_times.hpp"
#include "model/alarm/process_watch.hpp"
#include "record/record_row.hpp"

namespace loopwarden::daemon::supervision {

// Detectors of one loop and their inputs. Everything that is pointed to outlives the supervisor.
struct MonitoredLoop {
  base::SpscRing<record::RecordRow>* cycles = nullptr;
  watch::WindowSettings window;
  alarm::WindowJudge* judge = nullptr;  // null: only the classical measures
  // Null: no alarm model_gap. Read during construction only.
  const plant::LoopModel* twin = nullptr;
  double history_s = 0.0;           // for a loop with a twin
  bool foreign_controller = false;  // another program or device controls the loop
  alarm::VerdictRuleSettings rule;
  alarm::ProcessSettings process{};
  std::string pv_unit{};
  alarm::CorrectiveSettings corrective{};
  CorrectiveChannels channels{};
  rt::LoopChannels* loop = nullptr;  // null: no planned moves
  std::uint32_t moves_lease = 0;     // cycles
};

// Called by the monitor's thread for each valve alarm that the window, the routine judgement or the
// twin (`reason`) of the newest step of `monitor` raised. Both references are valid during the
// call.
using Raised =
    std::function<void(std::size_t loop, alarm::AlarmKind alarm, const watch::LoopMonitor& monitor,
                       const watch::MonitorStep& step, alarm::AlarmReason reason)>;

// Supervises one loop: owns its detectors, its alarms, its incident, its corrective action and
// its planned moves.
//
// The monitor's thread steps the detectors over the cycles of the loop. Each result changes the
// alarms, and then the corrective action follows. Any thread may use `alarms()`.
class LoopSupervisor {
 public:
  static constexpr std::size_t kCyclesATurn = 256;

  LoopSupervisor(std::size_t index, SupervisedLoop loop, const alarm::AlarmSettings& settings,
                 journal::Journal& journal, std::function<std::int64_t()> utc_ms)
      : index_(index), alarms_(std::move(loop), settings, journal, std::move(utc_ms)) {}
  LoopSupervisor(const LoopSupervisor&) = delete;
  LoopSupervisor& operator=(const LoopSupervisor&) = delete;

  JournaledAlarms& alarms() noexcept { return alarms_; }
  const JournaledAlarms& alarms() const noexcept { return alarms_; }

  // Creates detectors, corrective action and planned moves. Alarms from before a restart stay on
  // until the detectors clear them. Call before the threads start.
  void watch(const MonitoredLoop& loop, Raised raised);

  struct Turn {
    std::size_t cycles = 0;   // taken from the ring
    std::size_t windows = 0;  // full ones
    bool more = false;        // the ring may have more cycles
  };
  // Steps at most kCyclesATurn cycles, and judges at most one window. Call after watch().
  Turn take_turn();
  void close() { corrective_->close(); }

  // Null if the loop has no twin. Any thread.
  const History* history() const noexcept { return history_.get(); }
  std::uint64_t dropped() const noexcept { return cycles_->dropped(); }  // any thread

 private:
  // Detectors of the monitor's thread.
  struct Detectors {
    explicit Detectors(const MonitoredLoop& loop)
        : monitor(loop.window, loop.rule, loop.judge, loop.twin, loop.foreign_controller),
          condition(loop.window),
          process(loop.window.sample_time_s, loop.process),
          process_settings(loop.process),
          pv_unit(loop.pv_unit),
          foreign_controller(loop.foreign_controller),
          times(loop.window.sample_time_s) {}
    watch::LoopMonitor monitor;
    watch::ConditionWatch condition;
    alarm::ProcessWatch process;
    alarm::ProcessSettings process_settings;
    std::string pv_unit;
    bool foreign_controller;
    watch::ModeTimes times;
    bool deviation_rests = false;                  // as the alarms have it
    bool pv_lost = false;                          // as the alarms have it
    base::Reason pv_silence = base::Reason::none;  // as the alarms have it
  };
  void restore_detectors();
  watch::MonitorStep step(const record::RecordRow& row);
  void watch_process(const record::RecordRow& row);
  // Returns true if the step was a full window.
  bool use_window(const watch::MonitorStep& step);
  void report_raised(const JournaledAlarms::AlarmKinds& alarms, const watch::MonitorStep& step,
                     alarm::AlarmReason reason);
  void publish_progress(std::size_t cycles);

  std::size_t index_;
  JournaledAlarms alarms_;
  base::SpscRing<record::RecordRow>* cycles_ = nullptr;
  std::unique_ptr<Detectors> detectors_;
  std::unique_ptr<History> history_;
  std::unique_ptr<CorrectiveControl> corrective_;
  std::optional<MovesPlanning> moves_;
  Raised raised_;
};

}  // namespace loopwarden::daemon::supervision
