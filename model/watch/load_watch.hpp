// SPDX-License-Identifier: Apache-2.0
// Is the load on a loop outside of what its healthy record showed? What its twin needs beside itself, stepped by the caller.
//
//   r = PV - y                     of TwinWatch, PV units
//   m_j <- m_j + (h/T_j)(r - m_j)  means over minutes, kMinutes_s, and over hours, kHours_s
//   outside   |m_j - mean| >= kDeviations times the standard deviation that the healthy record and the load's
//             intensity give m_j, and at least kLeast of the span; until it is below kBack of that
//   step      means of blocks of half an answer: both newest ones differ from both before the third newest by kDeviations
//             times what load and noise do in that time, kSlack times the healthy record's largest and kLeast of the span; it stands until the
//             mean over minutes is back by half of it, at most kStands_s
//
//   h  s, sample time
//
// Errors: none.
// What it can't do: say where the load comes from; tell a load from a valve or process that has changed: where
// TwinWatch speaks, r is no load. A twin that does not know its healthy record's load has no watch.
//
// Source: Roberts, Technometrics 1 (1959) 239-250 (control charts of exponentially weighted means).
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "model/plant/loop_model.hpp"

namespace loopwarden::watch {

// Of the model's random load, PV units per root second; 0: none.
double load_intensity(const plant::LoopModel& model);

struct LoadOutside {
  double size = 0.0;     // PV units, from the healthy record's mean, or of a step
  double since_s = 0.0;  // so long ago
};

class LoadWatch {
 public:
  static constexpr double kMinutes_s = 60.0;
  static constexpr double kHours_s = 3600.0;
  static constexpr double kDeviations = 5.0;
  static constexpr double kSlack = 1.5;
  static constexpr double kLeast = 0.01;
  static constexpr double kBack = 0.7;
  static constexpr double kStands_s = 1800.0;

  explicit LoadWatch(const plant::LoopModel& twin);

  // One cycle; r NaN where the twin can't judge. No allocation.
  void add(double r) noexcept;
  std::optional<LoadOutside> outside() const noexcept;

  // Of the newest samples, for a healthy record.
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
  double stepped_ = 0.0;    // the step that stands; 0: none
  double from_ = 0.0;       // where it began, PV units
  double outside_s_ = 0.0;  // so long
  double stands_s_ = 0.0;
};

}  // namespace loopwarden::watch
