// SPDX-License-Identifier: Apache-2.0
// Does the loop still behave as commissioned? The twin's prediction of PV from CO and past PV, one sample ahead,
// and two cumulative sums on what it misses, stepped by the caller.
//
//   y(k)     PV of the twin under the measured CO, without noise and load
//   d(k+1) = d(k) + K n(k),   n(k) = PV(k) - y(k) - d(k)      innovation; d the load, K its Kalman gain
//   v(k)   = N^2 + f^2 + sum over the parameters of (y_i(k) - y(k) - d_i(k))^2
//
// where y_i is y with gain, time constant or dead time off by what the twin allows, d_i filtered as d, N the standard
// deviation of n by noise, rounding and load, f what a healthy valve's friction may leave. A plant that has moved within
// its uncertainty is thus no gap. Over each block of about half the loop's answer
//
//   size   = mean of n^2/v
//   colour = (sum of n)^2/(B N^2 + (B f)^2 + sum over the parameters of (sum of y_i - y - d_i)^2),   B samples
//
// and S <- clamp(S + min(statistic - limit, kMostInBlock), 0, 2 kAlarm) for each: one block alone is no alarm. On where
// one of them reaches kAlarm, off where both have been below a quarter of it for kQuiet_s. Limits: kSlack times the largest of the healthy
// record, at least kLeastLimitSize and kLeastLimitColour. A block whose mean PV lies outside what that record showed, by
// kOutside of it, says nothing: the twin is extrapolated there; counting begins anew when PV is back.
//
//   PV, y, d, n  PV units     CO  CO units     S, size, colour  1
//
// Errors: none; effects::EffectError from the constructor for a twin that can't be stepped.
// What it can't do: say what has changed; see changes of a loop that neither CO nor load moves; a load that is larger
// than in the healthy record is a gap too.
//
// Sources: Page, Biometrika 41 (1954) 100-115 (cumulative sum); Kalman, J. Basic Eng. 82 (1960) 35-45; Frank and Ding,
// J. Process Control 7 (1997) 403-424 (thresholds that follow the model's uncertainty).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "model/plant/plant.hpp"

namespace loopwarden::monitor {

class TwinWatch {
 public:
  static constexpr double kSlack = 1.5;
  static constexpr double kLeastLimitSize = 2.0;
  static constexpr double kLeastLimitColour = 4.0;
  static constexpr double kAlarm = 20.0;
  static constexpr double kMostInBlock = 5.0;
  static constexpr double kFriction = 0.003;  // of the CO span
  static constexpr double kQuiet_s = 900.0;
  static constexpr double kOutside = 0.05;

  explicit TwinWatch(const plant::LoopModel& twin);

  // The loop's cycle: PV as read, NaN where it is not good, and CO that went out because of it. True when a block ended.
  // No allocation.
  bool add(double pv, double co) noexcept;
  // Nothing is known of what CO did until now.
  void restart() noexcept { started_ = false; }
  // The condition from before a restart of the program; as much evidence must speak against it as had spoken for it.
  void restore(bool on) noexcept {
    on_ = on;
    size_sum_ = on ? kAlarm : 0.0;
  }

  bool on() const noexcept { return on_; }
  // Neither sum holds anything against the twin.
  bool quiet() const noexcept { return size_sum_ == 0.0 && colour_sum_ == 0.0; }
  double innovation() const noexcept { return innovation_; }  // PV units
  // Of the newest block.
  double size() const noexcept { return size_; }
  double colour() const noexcept { return colour_; }

 private:
  void start(double pv, double co) noexcept;
  void begin_block() noexcept;
  void end_block() noexcept;

  std::vector<plant::Plant> plants_;  // as commissioned, then each parameter off by its allowance
  std::array<double, 4> load_{};      // d, d_i
  std::array<double, 4> predicted_{};
  double gain_;          // K
  double noise2_;        // N^2, PV units squared
  double friction_;      // f, PV units
  std::size_t block_;    // samples
  std::size_t warm_up_;  // samples from a start until blocks count
  double size_limit_;
  double colour_limit_;
  double seen_low_;   // PV units
  double seen_high_;  // PV units

  bool started_ = false;
  std::size_t since_start_ = 0;
  std::size_t in_block_ = 0;
  double sum_size_ = 0.0;
  double sum_innovation_ = 0.0;
  double sum_pv_ = 0.0;
  std::array<double, 4> sum_off_{};  // of y_i - y - d_i
  double innovation_ = 0.0;
  double size_ = 1.0;
  double colour_ = 1.0;
  double size_sum_ = 0.0;    // S
  double colour_sum_ = 0.0;  // S
  bool on_ = false;
  std::size_t quiet_blocks_ = 0;
  std::size_t most_quiet_;  // blocks
};

}  // namespace loopwarden::monitor
