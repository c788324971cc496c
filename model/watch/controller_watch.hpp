// SPDX-License-Identifier: Apache-2.0
// Does the controller still do what it did when the loop was commissioned? The twin's controller beside it, from the
// measured SP and PV to CO, stepped by the caller.
//
//   u(k)   CO of the twin's law (control/pid.hpp) from SP, PV and the measured CO before, within the output's range
//   n = CO - u; the law's integral moves by g n, g = h over the loop's answer: where the law began is not known
//   S <- clamp(S + min(mean n^2/N^2 - limit, kMostInBlock), 0, 2 kAlarm)     over blocks of half an answer
//
// N is what the healthy record left, at least a converter's rounding twice; the limit kLimit. On where S reaches kAlarm,
// off where it has been below a quarter of it for kQuiet_s. Other gains, a filter, a dead band, other limits and another form all leave CO elsewhere.
//
// Watched only where the healthy record's CO is within kWithin of its resolutions (of 12 bits where it is finer), rms: else why_not()
// says what is known.
//
//   n, N  CO units     S  1
//
// Errors: none.
// What it can't do: say what has changed; see another integral action while SP - PV is 0; follow a controller that
// something else moves as well (feed-forward, tracking, override, a compensator): that one is not watched.
//
// Source: Page, Biometrika 41 (1954) 100-115 (cumulative sum).
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "model/control/pid.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::watch {

class ControllerWatch {
 public:
  static constexpr double kWithin = 2.0;
  static constexpr double kLimit = 3.0;
  static constexpr double kMostInBlock = 5.0;
  static constexpr double kAlarm = 20.0;
  static constexpr double kQuiet_s = 900.0;

  explicit ControllerWatch(const plant::LoopModel& twin);

  // The loop's cycle in automatic: what the controller read, and CO that it made of it. No allocation.
  void add(double sp, double pv, double co) noexcept;
  // Nothing is known of what the controller did until now.
  void restart() noexcept { started_ = false; }
  void restore(bool on) noexcept { on_ = on; }

  bool watched() const noexcept { return watched_; }
  // A sentence; empty where it is watched.
  std::string why_not() const;
  bool on() const noexcept { return on_; }
  bool quiet() const noexcept { return sum_ == 0.0; }
  double score() const noexcept { return sum_ / kAlarm; }
  double apart() const noexcept { return apart_; }  // n of the newest sample, CO units
  double size() const noexcept { return size_; }    // mean n^2/N^2 of the newest block
  double untested_s() const noexcept;               // since gains a quarter off would have shown
  bool tested() const noexcept { return tested_; }  // ever
  // Of the healthy record, with what plant::SeenController says.
  static bool can_watch(const plant::SeenController& seen, double co_span) noexcept;

 private:
  void end_block() noexcept;

  control::Pid law_;
  control::Pid other_;  // gains a quarter higher
  std::optional<plant::SeenController> seen_;
  double co_span_;
  double sample_time_s_;
  double follow_;  // g
  double noise2_;  // N^2
  bool watched_;
  std::size_t block_;
  std::size_t most_quiet_;  // samples

  bool started_ = false;
  bool on_ = false;
  double last_co_ = 0.0;
  double apart_ = 0.0;
  double size_ = 0.0;
  double squares_ = 0.0;
  double other_squares_ = 0.0;
  double sum_ = 0.0;  // S
  std::size_t in_block_ = 0;
  std::size_t quiet_samples_ = 0;
  std::size_t untested_ = 0;  // samples
  bool tested_ = false;
};

}  // namespace loopwarden::watch
