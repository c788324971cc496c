// SPDX-License-Identifier: Apache-2.0
// Detects whether the controller has changed since the loop was commissioned. The twin's controller
// runs in parallel, from the measured SP and PV to CO. Stepped by the caller. Equations:
// docs/math/twin-watch.md.
//
// The controller is watched only if the rms error of the healthy record's CO is within kWithin of
// its resolutions (of 12 bits if it is finer). Otherwise why_not() returns the reason. No errors.
// Limits: it can't name the change; see another integral action while SP - PV is 0; follow a
// controller whose output has other inputs (feed-forward, tracking, override, a compensator). Such
// a controller is not watched.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "model/control/pid.hpp"
#include "model/plant/loop_model.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::watch {

class ControllerWatch {
 public:
  explicit ControllerWatch(const plant::LoopModel& twin);

  // Adds a cycle in automatic: the inputs of the controller, and its CO. No allocation.
  void add(double sp, double pv, double co) noexcept;
  // Restarts the comparison: the controller's actions until now are unknown.
  void restart() noexcept { started_ = false; }
  void restore(bool on) noexcept { on_ = on; }

  bool watched() const noexcept { return watched_; }
  // Returns the reason as a sentence; empty if the controller is watched.
  std::string why_not() const;
  bool on() const noexcept { return on_; }
  bool quiet() const noexcept { return sum_ == 0.0; }
  double score() const noexcept { return sum_ / Limits::kControllerAlarm; }
  double apart() const noexcept { return apart_; }  // n of the newest sample, CO units
  double size() const noexcept { return size_; }    // mean n^2/N^2 of the newest block
  double untested_s()
      const noexcept;  // since a change of the gains by a quarter would have been detected
  bool tested() const noexcept { return tested_; }  // at any time
  // Returns whether the healthy record, in plant::SeenController, allows a watch.
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
