// SPDX-License-Identifier: Apache-2.0
// Checks whether the disturbance of a loop is outside the range of its healthy record. The
// disturbance is the difference between PV and the twin's PV. Stepped by the caller. Equations:
// docs/math/twin-watch.md. No errors.
//
// Limits: it can't name the source of the disturbance, or distinguish it from a change of valve or
// process. When TwinWatch reports a change, r is no disturbance. A twin without the load of its
// healthy record has no watch.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "model/plant/loop_model.hpp"

namespace loopwarden::watch {

// Returns the intensity of the model's random load, PV units per root second; 0: no load.
double load_intensity(const plant::LoopModel& model);

struct LoadOutside {
  double size = 0.0;     // PV units, from the healthy record's mean, or of a step
  double since_s = 0.0;  // s, age of the event
};

class LoadWatch {
 public:
  explicit LoadWatch(const plant::LoopModel& twin);

  // Adds one cycle. r is NaN if the twin can't judge. No allocation.
  void add(double r) noexcept;
  std::optional<LoadOutside> outside() const noexcept;

  // The means of the newest samples, for a healthy record.
  double over_minutes() const noexcept { return means_[0]; }
  double step() const noexcept { return step_; }

 private:
  bool level_outside() const noexcept;
  void judge_step() noexcept;

  bool known_;
  double sample_time_s_;
  double mean_ = 0.0;
  std::array<double, 2> limits_{};  // PV units
  double step_limit_ = 0.0;
  std::size_t block_;
  std::size_t settled_;  // samples

  std::array<double, 2> means_{};
  std::array<double, 5> blocks_{};  // newest last
  std::size_t samples_ = 0;
  std::size_t in_block_ = 0;
  std::size_t full_blocks_ = 0;
  double sum_ = 0.0;
  double step_ = 0.0;       // between the newest blocks
  double stepped_ = 0.0;    // the step in force; 0: no step
  double from_ = 0.0;       // its start, PV units
  double outside_s_ = 0.0;  // duration
  double stands_s_ = 0.0;
};

}  // namespace loopwarden::watch
