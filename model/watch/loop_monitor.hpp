// SPDX-License-Identifier: Apache-2.0
// What watches one loop: cycles in, windows judged, conditions of alarms out. The daemon's monitor thread
// and `loopwarden replay` step this same class.
//
//   cycle -> WindowBuilder -> measures -> fit to be judged? -> WindowJudge -> VerdictRule -> conditions
//         -> RoutineWatch -----------------------------------------------------------------^
//         -> TwinWatch, ControllerWatch (where there is a twin): model_gap ------------------^
//         -> LoadWatch: while the load is outside of the healthy record's and nothing speaks against the twin, no valve
//            alarm comes
//
// Where the specialists' windows name a fault, it is that one: they tell valve effects apart better. Where they name none,
// routine evidence may; their opinion has its weight in it (routine_watch.hpp), and without specialists it stands alone.
//
// A window with CO at an end of its range for more than kMostSaturated of its samples is not judged: the
// loop is open there, and every valve looks stuck. In manual the valve may be worked on: what was seen
// before is no evidence any more, and the rule starts over.
//
// Errors: none.
// What it can't do: keep alarms; that is LoopAlarms, which needs operators and a clock.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "model/watch/controller_watch.hpp"
#include "model/watch/load_watch.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/watch/routine_watch.hpp"
#include "model/watch/twin_remarks.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/alarm/verdict_rule.hpp"
#include "model/watch/window_builder.hpp"
#include "model/alarm/window_judge.hpp"
#include "model/alarm/window_measures.hpp"

namespace loopwarden::watch {

inline constexpr double kMostSaturated = 10.0;  // % of a window's samples

struct MonitorStep {
  enum class Kind : std::uint8_t {
    nothing,
    interrupted,  // no window can be had: state says why
    not_fit,      // a window is full but was not judged: state says why, measures are there
    judged        // measures, judgement and conditions are there
  };
  Kind kind = Kind::nothing;
  alarm::WindowState state = alarm::WindowState::filling;
  alarm::WindowMeasures measures;
  alarm::WindowJudgement judgement;
  alarm::AlarmConditions conditions{};
  // Minutes or hours were judged as well: this step's conditions hold, whatever `kind` is.
  std::optional<RoutineWatch::Judgement> routine;
  // The twin's watch changed its mind: this step's conditions hold, whatever `kind` is.
  bool twin = false;
};

class LoopMonitor {
 public:
  // `judge` may be null, then there are only the classical measures; it outlives this.
  // `twin`, at the cycles' period, may be null: then there is no model_gap. Throws effects::EffectError for one that can't
  // be stepped. `foreign_controller`: the twin's controller is watched as well. Not where this program has the loop: it
  // changes gains, jacket and compensator itself, and the journal has each change.
  LoopMonitor(const WindowSettings& window, const alarm::VerdictRuleSettings& rule,
              alarm::WindowJudge* judge, const plant::LoopModel* twin = nullptr,
              bool foreign_controller = true)
      : builder_(window), rule_(rule), judge_(judge) {
    if (window.routine) routine_.emplace(window);
    if (twin != nullptr) twin_.emplace(*twin);
    if (twin != nullptr && foreign_controller) controller_.emplace(*twin);
    if (twin != nullptr) load_.emplace(*twin);
  }

  // No allocation but what the measures and the routine evidence need for a full window.
  MonitorStep add(const Cycle& cycle);

  // Planned moves act: windows and minutes show them, and not the valve, whose conditions stay as they were.
  void calm(bool acts) noexcept { calm_ = acts; }
  // A condition from before a restart.
  void restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept;
  alarm::WindowState state() const noexcept { return builder_.state(); }
  // The window of the step that was just made, where there was one; until the next call of add().
  alarm::Window window() const noexcept { return builder_.window(); }
  // The samples of the step's routine judgement, where there was one; until the next call of add().
  RoutineWatch::Samples routine_samples() const noexcept {
    return routine_ ? routine_->samples() : RoutineWatch::Samples{};
  }
  // The present state of routine evidence. No allocation.
  RoutineWatch::Levels routine_levels() const noexcept {
    return routine_ ? routine_->levels() : RoutineWatch::Levels{};
  }
  const WindowSettings& settings() const noexcept { return builder_.settings(); }
  // Null: there is no twin.
  const TwinWatch* twin() const noexcept { return twin_ ? &*twin_ : nullptr; }
  const ControllerWatch* controller() const noexcept {
    return controller_ ? &*controller_ : nullptr;
  }
  // Nothing: there is no twin. No allocation.
  std::optional<TwinRemarks> remarks() const noexcept;
  // There is a twin, and nothing speaks against it.
  bool twin_quiet() const noexcept {
    return twin_ && twin_->quiet() && (!controller_ || controller_->quiet());
  }

 private:
  std::optional<LoadOutside> load_outside() const noexcept;
  MonitorStep judge_windows(const Cycle& cycle);
  alarm::AlarmConditions conditions() noexcept;
  bool twin_on() const noexcept { return twin_->on() || (controller_ && controller_->on()); }
  bool watch_twin(const Cycle& cycle) noexcept;

  WindowBuilder builder_;
  alarm::VerdictRule rule_;
  std::optional<RoutineWatch> routine_;
  std::optional<TwinWatch> twin_;
  std::optional<LoadWatch> load_;              // with the twin
  std::optional<ControllerWatch> controller_;  // with the twin, of a foreign controller
  alarm::AlarmConditions told_{};
  bool calm_ = false;
  static constexpr std::uint64_t kMostBridged = 100;  // cycles
  std::uint64_t next_period_ = 0;
  double last_co_ = std::numeric_limits<double>::quiet_NaN();  // CO units
  alarm::WindowJudge* judge_;
};

}  // namespace loopwarden::watch
