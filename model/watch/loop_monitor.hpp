// SPDX-License-Identifier: Apache-2.0
// The monitor of one loop: takes cycles, judges windows and returns the conditions of the alarms.
// The daemon's monitor thread and `loopwarden replay` step this same class.
//
//   cycle -> WindowBuilder -> measures -> fit to be judged? -> WindowJudge -> VerdictRule
//                                                                             -> conditions
//         -> RoutineWatch --------------------------------------------------> conditions
//         -> TwinWatch, ControllerWatch (with a twin): model_gap -----------> conditions
//         -> LoadWatch: raises no valve alarm while the load is outside of the healthy record's
//            and the twin is quiet
//
// If the specialists' windows name a fault, that fault is used, because they distinguish valve
// effects better. If they name no fault, routine evidence may name one. The specialists' opinion
// has its weight in it (routine_watch.hpp); without specialists, routine evidence is used without
// it.
//
// A window with CO at an end of its range for more than kMostSaturated of its samples is not
// judged: the loop is open then, and every valve looks stuck. In manual the valve may be under
// repair, so the rule discards its evidence and starts over.
//
// No errors.
// Limits: it can't keep alarms. LoopAlarms does, with operators and a clock.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
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

struct MonitorStep {
  enum class Kind : std::uint8_t {
    nothing,
    interrupted,  // no window is available; the reason is in `state`
    not_fit,      // a full window was not judged; the reason is in `state`; measures are valid
    judged        // measures, judgement and conditions are valid
  };
  Kind kind = Kind::nothing;
  alarm::WindowState state = alarm::WindowState::filling;
  alarm::WindowMeasures measures;
  alarm::WindowJudgement judgement;
  alarm::AlarmConditions conditions{};
  // Set if routine evidence judged minutes or hours as well. Then `conditions` is valid, whatever
  // `kind` is.
  std::optional<RoutineWatch::Judgement> routine;
  // True if the twin's watch has changed its result. Then `conditions` is valid, whatever `kind`
  // is.
  bool twin = false;
};

class LoopMonitor {
 public:
  // `judge` may be null: then there are only the classical measures. It outlives this object.
  // `twin` has the cycles' period and may be null: then there is no model_gap. Throws
  // effects::EffectError for a twin that can't be stepped. `foreign_controller`: the twin's
  // controller is watched as well. Set it to false if this program runs the loop: then it changes
  // gains, jacket and compensator itself, and the journal has each change.
  LoopMonitor(const WindowSettings& window, const alarm::VerdictRuleSettings& rule,
              alarm::WindowJudge* judge, const plant::LoopModel* twin = nullptr,
              bool foreign_controller = true)
      : builder_(window), rule_(rule), judge_(judge) {
    if (window.routine) routine_.emplace(window);
    if (twin == nullptr) return;
    twin_ = std::make_unique<TwinWatch>(*twin);
    if (foreign_controller) controller_ = std::make_unique<ControllerWatch>(*twin);
    load_ = std::make_unique<LoadWatch>(*twin);
  }

  // Adds a cycle. Allocates only what the measures and the routine evidence need for a full window.
  MonitorStep add(const Cycle& cycle);

  // Reports whether planned moves act. Windows and minutes then show the moves and not the valve,
  // so the conditions keep their state.
  void calm(bool acts) noexcept { calm_ = acts; }
  // Restores a condition from before a restart.
  void restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept;
  alarm::WindowState state() const noexcept { return builder_.state(); }
  // Returns the window of the newest step, if the step has one. Valid until the next call of add().
  alarm::Window window() const noexcept { return builder_.window(); }
  // Returns the samples of the newest step's routine judgement, if any. Valid until the next call
  // of add().
  RoutineWatch::Samples routine_samples() const {
    return routine_ ? routine_->samples() : RoutineWatch::Samples{};
  }
  // The present state of routine evidence. No allocation.
  RoutineWatch::Levels routine_levels() const noexcept {
    return routine_ ? routine_->levels() : RoutineWatch::Levels{};
  }
  const WindowSettings& settings() const noexcept { return builder_.settings(); }
  // Returns the twin's watch; null without a twin.
  const TwinWatch* twin() const noexcept { return twin_.get(); }
  const ControllerWatch* controller() const noexcept { return controller_.get(); }
  // Returns the remarks of the twin; empty without a twin. No allocation.
  std::optional<TwinRemarks> remarks() const noexcept;
  // Returns whether a twin exists and shows no sign of a change.
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
  // Not inside this object, because most loops have no twin, and these have 6 kB.
  std::unique_ptr<TwinWatch> twin_;
  std::unique_ptr<LoadWatch> load_;              // with the twin
  std::unique_ptr<ControllerWatch> controller_;  // with the twin, of a foreign controller
  alarm::AlarmConditions told_{};
  bool calm_ = false;
  std::uint64_t next_period_ = 0;
  double last_co_ = std::numeric_limits<double>::quiet_NaN();  // CO units
  alarm::WindowJudge* judge_;
};

}  // namespace loopwarden::watch
