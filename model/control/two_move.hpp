// SPDX-License-Identifier: Apache-2.0
// The two-move method: one move frees the stem, the second one puts it at the position that brings
// PV to SP (kind `two_move`). It acts in `simulate` and `compare` only; a running loop has it in
// shadow.
//
//   v  = uc - us                                deviation from the estimated steady-state CO us
//   1: u = uc + sign(duc) (|v| + f d)           for move_time_s after the output has arrived there
//   2: u = us                                   from then on, with the integral held
//
//   u, uc, us, d  CO units     d  stick_band, of the valve, an estimate     f  factor, > 1
//
// us is the mean of the stem over a cycle: in a steady cycle the integral of the error is zero. The
// stem is taken to rest at the highest uc of the cycle while the error drives uc down, and at the
// lowest while it drives it up:
//   us = lowest + (highest - lowest) (share of the cycle in which the error is negative)
// Two cycles at the present set point must agree within d/4. (The mean of uc is not us: the valve
// rests longer at one end.) A loop that does not cycle stays under PI.
//
// It disengages, without a bump, when the set point changes, and when the mean error (first-order
// mean over mean_error_time_s) exceeds max_mean_error. Then the cycles are counted again.
//
// Offset: the published method takes a stem that moves all the way to u once |u - x| > d. With
// moving friction it stops (S - J)/2 short of us, and us itself is an estimate, so that PV stays
// off SP by about K ((S - J)/2 + error of us). After a disturbance of l PV units the offset is l,
// until it exceeds max_mean_error: the controller is out of the loop.
//
// Limits: it needs a steady disturbance, and a cycle to learn from. A cycle that the valve makes
// and one with an external cause look the same to it.
//
// Source: Srinivasan and Rengaswamy, Comput. Chem. Eng. 32 (2008) 2218-2229; thesis, equations 4.5
// to 4.8. The estimate of us and the disengagement are this project's.
#pragma once

#include <cmath>
#include <cstdint>

#include "model/control/compensator_contract.hpp"
#include "model/control/reversals.hpp"

namespace loopwarden::control {

class TwoMove {
 public:
  TwoMove(const CompensatorSettings& settings, double period_s) noexcept
      : settings_(settings), period_s_(period_s), reversals_(settings.stick_band / 4.0) {}

  void reset(double output) noexcept {
    learn_afresh(output);
    set_point_known_ = false;
  }

  Correction step(const CompensatorInputs& in) noexcept {
    const bool acting = phase_ != Phase::learning;
    const bool moved = set_point_known_ && in.set_point != set_point_;
    set_point_ = in.set_point;
    set_point_known_ = true;
    mean_error_ +=
        std::fmin(1.0, period_s_ / settings_.mean_error_time_s) * (in.error - mean_error_);
    if (moved || (acting && std::abs(mean_error_) > settings_.max_mean_error)) {
      learn_afresh(in.output);
      return {.release = acting};
    }
    if (phase_ == Phase::learning) {
      learn(in.output, in.error);
      virtual_output_ = in.commanded;
      if (phase_ == Phase::learning) return {};
    }
    const double steady = steady_output_ - in.output;
    if (phase_ == Phase::first_move) {
      const double size = std::abs(steady) + settings_.factor * settings_.stick_band;
      if (has_arrived(in.limits, in.output + sign_ * size, output_before(in), period_s_))
        in_phase_s_ += period_s_;
      if (in_phase_s_ <= settings_.move_time_s + 0.5 * period_s_) {
        virtual_output_ =
            limit_output(in.limits, in.output + sign_ * size, virtual_output_, period_s_).output;
        return {.added = sign_ * size, .hold_integral = true};
      }
      phase_ = Phase::resting;
    }
    return {.added = steady, .hold_integral = true};
  }

  bool resting() const noexcept { return phase_ == Phase::resting; }
  double mean_error() const noexcept { return mean_error_; }

 private:
  enum class Phase : std::uint8_t { learning, first_move, resting };

  // CO one period ago; in shadow as it would be.
  double output_before(const CompensatorInputs& in) const noexcept {
    return settings_.shadow ? virtual_output_ : in.commanded;
  }

  void learn_afresh(double output) noexcept {
    phase_ = Phase::learning;
    reversals_.reset(output);
    last_direction_ = 0;
    begin_cycle(output);
    cycle_began_ = false;
    mean_known_ = false;
    mean_error_ = 0.0;
  }

  void begin_cycle(double output) noexcept {
    lowest_ = output;
    highest_ = output;
    samples_ = 0.0;
    negative_ = 0.0;
  }

  // A cycle ends where uc turns upwards.
  void learn(double output, double error) noexcept {
    const int direction = reversals_.step(output);
    const bool turned_up = direction > 0 && last_direction_ < 0;
    last_direction_ = direction;
    if (turned_up) {
      const double mean = lowest_ + (highest_ - lowest_) * negative_ / std::fmax(1.0, samples_);
      const bool agrees =
          mean_known_ && std::abs(mean - steady_output_) < settings_.stick_band / 4.0;
      if (agrees) {
        steady_output_ = (mean + steady_output_) / 2.0;
        phase_ = Phase::first_move;
        in_phase_s_ = 0.0;
        sign_ = 1.0;  // uc has just turned upwards
        mean_error_ = 0.0;
        return;
      }
      if (cycle_began_) {
        steady_output_ = mean;
        mean_known_ = true;
      }
      cycle_began_ = true;
      begin_cycle(output);
    }
    lowest_ = std::fmin(lowest_, output);
    highest_ = std::fmax(highest_, output);
    samples_ += 1.0;
    if (error < 0.0) negative_ += 1.0;
  }

  CompensatorSettings settings_;
  double period_s_;  // s
  Phase phase_ = Phase::learning;
  Reversals reversals_;
  int last_direction_ = 0;
  double lowest_ = 0.0;   // CO units, of the present cycle
  double highest_ = 0.0;  // CO units
  double samples_ = 0.0;
  double negative_ = 0.0;  // samples with a negative error
  bool cycle_began_ = false;
  bool mean_known_ = false;
  double steady_output_ = 0.0;  // us, CO units
  double sign_ = 1.0;
  double in_phase_s_ = 0.0;      // s, of a move since CO has arrived
  double virtual_output_ = 0.0;  // CO units, in shadow
  double set_point_ = 0.0;       // PV units
  bool set_point_known_ = false;
  double mean_error_ = 0.0;  // PV units
};

}  // namespace loopwarden::control
