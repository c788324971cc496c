// SPDX-License-Identifier: Apache-2.0
// The monitor's thread: takes every loop's cycles, cuts them into windows and has them judged.
//
// Loops are served in turn. In one turn a loop gives at most kCyclesATurn cycles and has at most one
// window judged, so that a loop with a long queue does not keep the others waiting; the next round
// begins behind the loop at which the last one ended. What a ring had no room for is counted by the
// ring, and breaks the window: the loop starts a new one.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/monitor/history.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "daemon/orders/order_desk.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "base/newest_value.hpp"
#include "base/spsc_ring.hpp"
#include "base/thread.hpp"
#include "record/record_row.hpp"
#include "model/monitor/condition_watch.hpp"
#include "model/monitor/corrective_action.hpp"
#include "model/monitor/loop_monitor.hpp"
#include "model/monitor/mode_times.hpp"
#include "model/monitor/process_watch.hpp"

namespace loopwarden::daemon::monitor {

struct MonitoredLoop {
  base::SpscRing<record::RecordRow>* cycles = nullptr;
  loopwarden::monitor::WindowSettings window;
  loopwarden::monitor::WindowJudge* judge = nullptr;  // null: only the classical measures
  const loopwarden::plant::LoopModel* twin =
      nullptr;                      // null: no model_gap; read while this is made
  double history_s = 0.0;           // of a loop with a twin
  bool foreign_controller = false;  // another program or device has the loop
  loopwarden::monitor::VerdictRuleSettings rule;
  loopwarden::monitor::ProcessSettings process{};
  std::string pv_unit{};
  loopwarden::monitor::CorrectiveSettings corrective{};
  // Where orders for jacket and planned moves go, used by the monitor's thread alone. Null: no corrective action.
  orders::OrderDesk* orders = nullptr;
  const std::atomic<std::uint32_t>* settings_taken = nullptr;  // where there are orders
  const std::atomic<bool>* commissioned = nullptr;             // where there are orders
  // Where corrective action has planned moves.
  base::NewestValue<control::PlannedMovesSettings>* moves_settings = nullptr;
  const rt::PlannedMovesStatus* moves = nullptr;
  bool hardware = false;  // they move something real
};

struct MonitorStatus {
  std::uint64_t windows = 0;  // looked at
  std::uint64_t cycles = 0;   // taken from the rings
  std::uint64_t dropped = 0;  // not taken: a ring was full
  std::size_t backlog = 0;    // loops whose cycles were not all taken in the last round
};

class Monitor {
 public:
  static constexpr std::size_t kCyclesATurn = 256;

  // Called by the monitor's thread as a valve alarm is raised, by the window, the routine judgement or the twin (`reason`) of
  // the step that `monitor` just made; both are valid meanwhile.
  using Raised = std::function<void(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                                    const loopwarden::monitor::LoopMonitor& monitor,
                                    const loopwarden::monitor::MonitorStep& step,
                                    loopwarden::monitor::AlarmReason reason)>;

  // What is pointed to outlives this. Alarms that the board knows from before a restart stay on until
  // windows say otherwise; process alarms until the cycles do.
  Monitor(const std::vector<MonitoredLoop>& loops, WatchBoard& board, Raised raised = {});
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;
  ~Monitor() { stop(); }

  void start();
  void stop();

  // One turn for every loop; public for tests.
  void round();

  MonitorStatus status() const noexcept;  // any thread
  // Of a loop with a twin; null: it has none. Any thread.
  const History* history(std::size_t loop) const noexcept { return tracks_[loop].history.get(); }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  struct PlannedMoves {
    base::NewestValue<control::PlannedMovesSettings>* to_loop;
    const rt::PlannedMovesStatus* state;
    bool hardware;
    bool on_order;
    double period_s;
    std::optional<control::PlannedMovesSettings> settings;  // nothing: the process has none
    std::shared_ptr<const Explanation> explained;           // the newest that was looked at
  };
  static std::optional<PlannedMoves> planned_moves_of(const MonitoredLoop& loop);
  struct Track {
    explicit Track(const MonitoredLoop& loop)
        : cycles(loop.cycles),
          orders(loop.orders),
          settings_taken(loop.settings_taken),
          commissioned(loop.commissioned),
          settings_seen(settings_taken != nullptr ? settings_taken->load() : 0),
          planned(planned_moves_of(loop)),
          monitor(loop.window, loop.rule, loop.judge, loop.twin, loop.foreign_controller),
          history(loop.twin == nullptr
                      ? nullptr
                      : std::make_unique<History>(loop.history_s, loop.twin->sample_time_s)),
          corrective(loop.orders != nullptr ? loop.corrective
                                            : loopwarden::monitor::CorrectiveSettings{}),
          condition(loop.window),
          process(loop.window.sample_time_s, loop.process),
          process_settings(loop.process),
          pv_unit(loop.pv_unit),
          times(loop.window.sample_time_s) {}
    base::SpscRing<record::RecordRow>* cycles;
    orders::OrderDesk* orders;
    const std::atomic<std::uint32_t>* settings_taken;
    const std::atomic<bool>* commissioned;
    std::uint32_t settings_seen;
    std::optional<PlannedMoves> planned;  // where corrective action has that form
    std::uint64_t order = 0;              // newest that is not answered yet; 0: none
    bool came = false;  // the alarm came, and corrective action has not heard of it yet
    loopwarden::monitor::LoopMonitor monitor;
    std::unique_ptr<History> history;  // where there is a twin
    loopwarden::monitor::CorrectiveAction corrective;
    loopwarden::monitor::ConditionWatch condition;
    loopwarden::monitor::ProcessWatch process;
    loopwarden::monitor::ProcessSettings process_settings;
    std::string pv_unit;
    bool deviation_rests = false;  // as the board knows it
    bool pv_lost = false;          // as the board knows it
    loopwarden::monitor::ModeTimes times;
  };
  // True if there may be more.
  bool take_turn(std::size_t index);
  void watch_process(std::size_t index, const record::RecordRow& row);
  // True if it was a window.
  bool pass_on(std::size_t index, const loopwarden::monitor::MonitorStep& step);
  void raised(std::size_t index, const std::vector<loopwarden::monitor::AlarmKind>& alarms,
              const loopwarden::monitor::MonitorStep& step,
              loopwarden::monitor::AlarmReason reason);
  // What the loop made of the last order, and what the operator wants.
  void attend(std::size_t index);
  // Whether the alarm is explained by now, and a person has ordered what is offered.
  void look_for_stick(std::size_t index);
  void follow_moves(std::size_t index, std::size_t cycles);
  void correct(std::size_t index, const loopwarden::monitor::MonitorStep& step, bool came);
  void follow(std::size_t index, const loopwarden::monitor::CorrectiveStep& step);

  std::vector<Track> tracks_;
  WatchBoard& board_;
  Raised raised_;
  std::int64_t started_ms_;  // alarms from before begin no planned moves by themselves
  std::size_t first_ = 0;    // loop at which the next round begins
  std::atomic<std::uint64_t> windows_{0};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::size_t> backlog_{0};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::monitor
