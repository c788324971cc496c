// SPDX-License-Identifier: Apache-2.0
// Corrective action: the jacket or planned moves, switched on when a valve is known to stick, watched, and switched back
// when it does not help. Stepped with the loop's windows; says what to order, and why.
//
//   RMS^2 = variability^2 + mean_error^2    of SP - PV in a window, % of the PV span
//   R, M    mean of RMS and of |mean_error| over kBaseline steady windows after the alarm came: a limit cycle
//           may last longer than a window. Planned moves: over what of them there are in shadow
//   r, m    the same over kTrial steady windows while it acts, the first kSettling left out
//   g       planned moves: RMS that they would have left in shadow over that without (MovesState::gain)
//
//   waiting    jacket: stiction was raised since this started, and there is a baseline -> on, trying
//              planned moves: it has been explained since                           -> shadow, in_shadow
//                             the same, and a person is to order them               -> offered
//   offered    the person's order                                                   -> shadow, in_shadow
//   in_shadow  after kShadow_s, with a baseline: g <= 1 - kLeastGain                -> on, trying
//                                                otherwise, or given back           -> back, given_up
//   trying     r <= (1 - kLeastGain) R; of the jacket m <= max(M, allowed_mean_error) -> helping
//              otherwise                                                            -> back, given_up
//   helping    over each kTrial steady windows the same; else                       -> back, given_up
//   offered, in_shadow   the newest explanation is another one                       -> back, waiting
//   in_shadow            explained anew, with other s and j                         -> shadow, in_shadow
//   trying, helping   planned moves: the stem follows their probe                   -> back, waiting
//                     they disengage for good, or for the third time                -> back,
//                     given_up
//                     they disengage                                                -> back,
//                     waiting
//   any        stiction no longer raised                                            -> back, waiting
//              the loop refused the order                                           -> given_up
//              the loop leaves automatic, or its PV is not good                     -> back, waiting
//              a reload                                                             -> back, waiting
//              the operator's veto, a commissioning                                 -> back, vetoed
//   vetoed     the veto is lifted, the commissioning ends                           -> waiting; a
//   jacket that was set by
//                                                                                      hand goes
//                                                                                      back to
//                                                                                      shadow
//
// Steady: judged, not saturated, and SP stood still, since a step's error would be compared with the limit
// cycle's. Given up means: not again for this alarm. What was raised before this started, in a run of the
// program before, is no reason to act: who knows what the operator decided then.
//
// `on` orders the loop's jacket from shadow to acting, in the form that the loop's file gives it, which must
// be `bounded` or `dwell`: both keep the integrator moving towards zero error (stickband_jacket.hpp). Planned moves
// (planned_moves.hpp) are ordered into shadow first. The mean error that they leave is within r.
//
// Errors: none.
// What it can't do: tell a jacket that helps from a disturbance that ends at the same time; see a set point
// that moves in every window: then it neither begins nor decides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "model/control/planned_moves_settings.hpp"
#include "model/monitor/window_measures.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::monitor {

// Windows; with the daemon's overlap and 96 s, 48 s each: 13, 6 and 32 minutes. A sticky loop's cycle lasts
// minutes, and the dwell form makes it several times as long.
inline constexpr std::size_t kBaseline = 16;
inline constexpr std::size_t kSettling = 8;
inline constexpr std::size_t kTrial = 40;
inline constexpr double kLeastGain = 0.05;  // of R
inline constexpr double kShadow_s = 600.0;
inline constexpr std::size_t kLeastBaseline = 4;  // steady windows in shadow
inline constexpr int kMostDisengaged = 3;         // of planned moves by one explanation

enum class CorrectiveForm : std::uint8_t { jacket, planned_moves };

struct CorrectiveSettings {
  bool enabled = false;
  CorrectiveForm form = CorrectiveForm::jacket;
  double allowed_mean_error_percent = 1.0;  // % of the PV span, >= 0: of the jacket
  // Of planned moves.
  bool on_order = false;                                                // a person begins them
  double max_move = std::numeric_limits<double>::infinity();            // CO units
  double max_moves_per_hour = std::numeric_limits<double>::infinity();  // 1/h

  friend bool operator==(const CorrectiveSettings&, const CorrectiveSettings&) = default;
};

// Numbers of the register map: they only grow.
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
  back,       // and the jacket goes back to shadow, planned moves end
  hands_off,  // the operator has set the jacket himself: it stays as it is until the veto is lifted
  commissioning  // by the daemon while the loop is commissioned: as back
};

struct CorrectiveStep {
  enum class Order : std::uint8_t { none, on, back, shadow };
  Order order = Order::none;
  CorrectiveForm form = CorrectiveForm::jacket;
  const char* why = "";  // where the state changed; static storage
  CorrectiveState from = CorrectiveState::off;
  CorrectiveState to = CorrectiveState::off;
  // Before and after, where they are known; else 0. % of the PV span.
  double rms_before = 0.0;
  double rms_after = 0.0;
  double mean_before = 0.0;
  double mean_after = 0.0;
  double gain_in_shadow = 0.0;  // RMS over that without

  bool changed() const noexcept { return from != to || order != Order::none; }
};

class CorrectiveAction {
 public:
  CorrectiveAction() = default;
  explicit CorrectiveAction(const CorrectiveSettings& settings) noexcept;

  // A window that was judged. `sticks`: the alarm's condition is on; `came`: with this window.
  CorrectiveStep window(const WindowMeasures& measures, bool sticks, bool came) noexcept;
  // No window can be had, or it was not fit to be judged.
  // `controlling`: the loop is in automatic on a good PV.
  CorrectiveStep interrupted(bool controlling) noexcept;
  CorrectiveStep veto(Veto veto) noexcept;
  // Planned moves: an alarm that came since this started is explained, with s and j, for the first time or anew.
  // `may_act` false: only in shadow.
  CorrectiveStep explained(bool may_act) noexcept;
  // Planned moves: the alarm is on, and its newest explanation has no s and j.
  CorrectiveStep explained_otherwise() noexcept;
  // Planned moves: the person's order for what is offered.
  CorrectiveStep ordered() noexcept;
  // What planned moves do; `passed_s` of the loop's time since the last call.
  CorrectiveStep moves(const control::MovesState& state, double passed_s) noexcept;
  // The loop did not do what was ordered: what is not there can't help. No order follows.
  CorrectiveStep refused() noexcept;
  // A reload has put jacket and compensator back into the state of their file. An order to act may still be
  // underway, so it is ordered back all the same.
  CorrectiveStep reloaded() noexcept;

  CorrectiveState state() const noexcept { return state_; }
  bool acting() const noexcept { return acts(state_); }
  // Planned moves act: windows show them, and not the valve.
  bool calms() const noexcept { return planned() && acting(); }
  // Planned moves are ordered, in shadow or acting.
  bool moves_run() const noexcept {
    return planned() && (acting() || state_ == CorrectiveState::in_shadow);
  }

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
  int disengaged_ = 0;                   // times, since the newest explanation
  std::array<Errors, kTrial> newest_{};  // of the steady windows, a ring
  std::size_t steady_ = 0;               // of them, since the last change of state
  std::size_t settling_ = 0;             // windows still to be left out
  bool due_ = false;  // the alarm came, and was not acted on yet; planned moves: it is explained
  bool ordered_ = false;  // by a person, for this alarm
  bool may_act_ = false;
  double shadow_s_ = 0.0;
  Errors before_;
};

}  // namespace loopwarden::monitor
