// SPDX-License-Identifier: Apache-2.0
// Corrective action against stiction. It engages the jacket or planned moves when a valve is known
// to stick, watches the result, and disengages them if the error doesn't fall. Stepped with the
// loop's windows. Each step has the command for the loop, and the reason.
//
//   RMS^2 = variability^2 + mean_error^2    of SP - PV in a window, % of the PV span
//   R, M    mean of RMS and of |mean_error| over kBaseline steady windows after the alarm was
//           raised, as a limit cycle may last longer than a window. Planned moves: over their
//           steady windows in shadow
//   r, m    the same over kTrial steady windows in action, without the first kSettling
//   g       planned moves: RMS predicted with them in shadow, over RMS without (MovesState::gain)
//
//   waiting    jacket: stiction was raised since this started, and there is
//              a baseline                                              -> on, trying
//              planned moves: it has been explained since              -> shadow, in_shadow
//              the same, and the operator must command them            -> offered
//   offered    the operator's command                                  -> shadow, in_shadow
//   in_shadow  after kShadow_s, with a baseline: g <= 1 - kLeastGain   -> on, trying
//              otherwise, or disengaged                                -> back, given_up
//   trying     r <= (1 - kLeastGain) R; of the jacket also
//              m <= max(M, allowed_mean_error)                         -> helping
//              otherwise                                               -> back, given_up
//   helping    the same over each kTrial steady windows; otherwise     -> back, given_up
//   offered, in_shadow   the newest explanation is another one         -> back, waiting
//   in_shadow            a new explanation has other s and j           -> shadow, in_shadow
//   trying, helping      planned moves: the stem follows their probe   -> back, waiting
//                        they disengage for good, or for the third time
//                                                                      -> back, given_up
//                        they disengage                                -> back, waiting
//   any        stiction no longer raised                               -> back, waiting
//              the loop refused the command                            -> given_up
//              the loop leaves automatic, or its PV is not good        -> back, waiting
//              a reload                                                -> back, waiting
//              the operator's veto, a commissioning                    -> back, vetoed
//   vetoed     the veto is lifted, the commissioning ends              -> waiting
//              (a jacket that was set manually returns to shadow)
//
// A steady window is judged, isn't saturated, and SP didn't move: otherwise the error of a step
// would be compared with that of the limit cycle. After `given_up` there is no further trial for
// this alarm. An alarm from before the start of the program starts no action, because the
// operator's decisions of that time are unknown.
//
// `on` takes the loop's jacket from shadow to acting, in the form of the loop's file. The form must
// be `bounded` or `dwell`: both keep the integrator moving towards zero error
// (stickband_jacket.hpp). Planned moves (planned_moves.hpp) enter shadow first. Their remaining
// mean error is within r.
//
// No errors.
// Limits: it can't distinguish the effect of a jacket from a disturbance that ends at the same
// time. With a set point that moves in every window it neither begins nor decides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "model/alarm/limits.hpp"
#include "model/control/planned_moves_settings.hpp"
#include "model/alarm/window_measures.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

enum class CorrectiveForm : std::uint8_t { jacket, planned_moves };

struct CorrectiveSettings {
  bool enabled = false;
  CorrectiveForm form = CorrectiveForm::jacket;
  double allowed_mean_error_percent = 1.0;  // % of the PV span, >= 0: jacket only
  // Planned moves only.
  bool on_order = false;                                                // the operator begins them
  double max_move = std::numeric_limits<double>::infinity();            // CO units
  double max_moves_per_hour = std::numeric_limits<double>::infinity();  // 1/h

  friend bool operator==(const CorrectiveSettings&, const CorrectiveSettings&) = default;
};

// The register map uses these numbers. New states are added at the end.
enum class CorrectiveState : std::uint8_t {
  off,
  waiting,
  trying,
  helping,
  given_up,
  vetoed,
  offered,
  in_shadow
};

constexpr const char* to_text(CorrectiveState state) noexcept {
  return numeric::enum_name<CorrectiveState::in_shadow>(
      state, {"off", "waiting", "trying", "helping", "given up", "vetoed", "offered", "in shadow"});
}

enum class Veto : std::uint8_t {
  none,
  back,          // and the jacket returns to shadow, planned moves end
  hands_off,     // the operator has set the jacket: it keeps its state until the veto is lifted
  commissioning  // by the daemon while the loop is commissioned: as back
};

struct CorrectiveStep {
  enum class Order : std::uint8_t { none, on, back, shadow };
  Order order = Order::none;
  CorrectiveForm form = CorrectiveForm::jacket;
  const char* why = "";  // reason if the state changed; static storage
  CorrectiveState from = CorrectiveState::off;
  CorrectiveState to = CorrectiveState::off;
  // % of the PV span, before and after; 0 if unknown.
  double rms_before = 0.0;
  double rms_after = 0.0;
  double mean_before = 0.0;
  double mean_after = 0.0;
  double gain_in_shadow = 0.0;  // RMS with planned moves over RMS without

  bool changed() const noexcept { return from != to || order != Order::none; }
};

class CorrectiveAction {
 public:
  CorrectiveAction() = default;
  explicit CorrectiveAction(const CorrectiveSettings& settings) noexcept;

  // Adds a judged window. `sticks`: the alarm's condition is on; `came`: it was raised with this
  // window.
  CorrectiveStep window(const WindowMeasures& measures, bool sticks, bool came) noexcept;
  // Reports an interruption: no window is available, or it was not fit to be judged.
  // `controlling`: the loop is in automatic on a good PV.
  CorrectiveStep interrupted(bool controlling) noexcept;
  CorrectiveStep veto(Veto veto) noexcept;
  // Planned moves: an alarm from this run of the program has an explanation with s and j, the first
  // or a new one. `may_act` false: only in shadow.
  CorrectiveStep explained(bool may_act) noexcept;
  // Planned moves: the alarm is on, and its newest explanation has no s and j.
  CorrectiveStep explained_otherwise() noexcept;
  // Planned moves: the operator commands the offered moves.
  CorrectiveStep ordered() noexcept;
  // Reports the state of the planned moves; `passed_s` is the loop's time since the last call.
  CorrectiveStep moves(const control::MovesState& state, double passed_s) noexcept;
  // The loop refused the command, so the action can't help. Sends no further command.
  CorrectiveStep refused() noexcept;
  // A reload has returned jacket and compensator to the state of their file. A command to act may
  // still be underway, so the step commands them back as well.
  CorrectiveStep reloaded() noexcept;

  CorrectiveState state() const noexcept { return state_; }
  bool acting() const noexcept { return acts(state_); }
  // Returns whether planned moves act. Windows then show the moves and not the valve.
  bool calms() const noexcept { return planned() && acting(); }

 private:
  struct Errors {
    double rms = 0.0;
    double mean = 0.0;
  };
  static bool acts(CorrectiveState state) noexcept {
    return state == CorrectiveState::trying || state == CorrectiveState::helping;
  }
  bool planned() const noexcept { return settings_.form == CorrectiveForm::planned_moves; }
  CorrectiveStep::Order order_of(CorrectiveState state) const noexcept;
  Errors newest_mean(std::size_t windows) const noexcept;
  CorrectiveStep begin() noexcept;
  CorrectiveStep shadowed(const control::MovesState& state) noexcept;
  CorrectiveStep go(CorrectiveState to, const char* why) noexcept;
  CorrectiveStep decide() noexcept;

  CorrectiveSettings settings_;
  CorrectiveState state_ = CorrectiveState::off;
  Veto veto_ = Veto::none;
  int disengaged_ = 0;                           // times, since the newest explanation
  std::array<Errors, Limits::kTrial> newest_{};  // ring of the steady windows
  std::size_t steady_ = 0;    // number of steady windows since the last change of state
  std::size_t settling_ = 0;  // windows still to skip
  bool due_ = false;          // an alarm without action so far; planned moves: with an explanation
  bool ordered_ = false;      // by the operator, for this alarm
  bool may_act_ = false;
  double shadow_s_ = 0.0;
  Errors before_;
};

}  // namespace loopwarden::alarm
