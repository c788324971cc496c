// SPDX-License-Identifier: Apache-2.0
// The jacket as corrective action: switched on when a valve is known to stick, watched, and switched back
// when it does not help. Stepped with the loop's windows; says what to order, and why.
//
//   RMS^2 = variability^2 + mean_error^2    of SP - PV in a window, % of the PV span
//   R, M    mean of RMS and of |mean_error| over kBaseline steady windows after the alarm came: a limit cycle
//           may last longer than a window
//   r, m    the same over kTrial steady windows with the jacket, the first kSettling left out
//
//   waiting    stiction was raised since this started, and there is a baseline     -> on, trying
//   trying     r <= (1 - kLeastGain) R and m <= max(M, allowed_mean_error)          -> helping
//              otherwise                                                            -> back, given_up
//   helping    over each kTrial steady windows the same; else                       -> back, given_up
//   any        stiction no longer raised                                            -> back, waiting
//              the loop refused the order for the jacket                            -> given_up
//              the loop leaves automatic, or its PV is not good                     -> back, waiting
//              a reload                                                             -> back, waiting
//              the operator's veto                                                  -> back, vetoed
//
// Steady: judged, not saturated, and SP stood still, since a step's error would be compared with the limit
// cycle's. Given up means: not again for this alarm. What was raised before this started, in a run of the
// program before, is no reason to act: who knows what the operator decided then.
//
// `on` orders the loop's jacket from shadow to acting, in the form that the loop's file gives it, which must
// be `bounded` or `dwell`: both keep the integrator moving towards zero error (stickband_jacket.hpp).
//
// Errors: none.
// What it can't do: tell a jacket that helps from a disturbance that ends at the same time; see a set point
// that moves in every window: then it neither begins nor decides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "model/monitor/window_measures.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::monitor {

// Windows; with the daemon's overlap and 96 s, 48 s each: 13, 6 and 32 minutes. A sticky loop's cycle lasts
// minutes, and the dwell form makes it several times as long.
inline constexpr std::size_t kBaseline = 16;
inline constexpr std::size_t kSettling = 8;
inline constexpr std::size_t kTrial = 40;
inline constexpr double kLeastGain = 0.05;  // of R

struct CorrectiveSettings {
  bool enabled = false;
  double allowed_mean_error_percent = 1.0;  // % of the PV span, >= 0

  friend bool operator==(const CorrectiveSettings&, const CorrectiveSettings&) = default;
};

enum class CorrectiveState : std::uint8_t { off, waiting, trying, helping, given_up, vetoed };

constexpr const char* to_text(CorrectiveState state) noexcept {
  return numeric::enum_name<CorrectiveState::vetoed>(
      state, {"off", "waiting", "trying", "helping", "given up", "vetoed"});
}

enum class Veto : std::uint8_t {
  none,
  back,      // and the jacket goes back to shadow
  hands_off  // the operator has set the jacket himself: it stays as it is
};

struct CorrectiveStep {
  enum class Order : std::uint8_t { none, on, back };
  Order order = Order::none;
  const char* why = "";  // where the state changed; static storage
  CorrectiveState from = CorrectiveState::off;
  CorrectiveState to = CorrectiveState::off;
  // Before and after, where they are known; else 0. % of the PV span.
  double rms_before = 0.0;
  double rms_after = 0.0;
  double mean_before = 0.0;
  double mean_after = 0.0;

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
  // The loop did not do what was ordered: a jacket that is not there can't help. No order follows.
  CorrectiveStep refused() noexcept;
  // A reload has put the jacket back into the state of its file, perhaps in another form. An order to act may still be
  // underway, so it is ordered back all the same.
  CorrectiveStep reloaded() noexcept;

  CorrectiveState state() const noexcept { return state_; }
  bool acting() const noexcept {
    return state_ == CorrectiveState::trying || state_ == CorrectiveState::helping;
  }

 private:
  struct Errors {
    double rms = 0.0;
    double mean = 0.0;
  };
  Errors newest_mean(std::size_t windows) const noexcept;
  CorrectiveStep go(CorrectiveState to, const char* why) noexcept;
  CorrectiveStep decide() noexcept;

  CorrectiveSettings settings_;
  CorrectiveState state_ = CorrectiveState::off;
  std::array<Errors, kTrial> newest_{};  // of the steady windows, a ring
  std::size_t steady_ = 0;               // of them, since the last change of state
  std::size_t settling_ = 0;             // windows still to be left out
  bool due_ = false;                     // the alarm came, and was not acted on yet
  Errors before_;
};

}  // namespace loopwarden::monitor
