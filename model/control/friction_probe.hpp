// SPDX-License-Identifier: Apache-2.0
// Finds out whether a valve still sticks: CO moves by 0.35 s, and a stem that follows is healthy.
//
// With a read-back the stem must follow in three values in a row. Without one the disturbance's
// estimate shows it. No call allocates or throws.
#pragma once

#include <cstdint>

#include "model/control/held_output.hpp"
#include "model/control/loop_estimator.hpp"

namespace loopwarden::control {

enum class ProbeResult : std::uint8_t { under_way, pushed, sticks, follows };

class FrictionProbe {
 public:
  FrictionProbe(const PlannedMovesSettings& settings, double period_s) noexcept;

  void begin(const OutputLimits& limits, HeldOutput& held) noexcept;
  // One period. `settle_s`: of the read-back after a stroke. `disturbance_before`: PV units, when
  // the probe was pushed. `pushed` is returned in the period in which CO moves.
  ProbeResult step(const LoopEstimator& loop, double settle_s, double disturbance_before,
                   HeldOutput& held) noexcept;
  // Time with CO held that a probe takes, `settle_s` and `ramp_s` included.
  static double duration_s(double settle_s, double sample_s, double ramp_s) noexcept;
  static double size(double s) noexcept;  // CO units

  void pass() noexcept { since_s_ += period_s_; }
  void count_move() noexcept { ++moves_since_; }
  // A move ended with the stem as without friction (`free`), or not.
  void count_landing(bool free) noexcept { free_landings_ = free ? free_landings_ + 1 : 0; }
  void forget_landings() noexcept { free_landings_ = 0; }
  // The probe was interrupted: it is to be repeated.
  void repeat() noexcept;
  // A probe is due: free landings, or many moves.
  bool is_due() const noexcept;
  double since_s() const noexcept { return since_s_; }  // since the last probe

 private:
  double period_s_;
  double gain_;
  double unseen_wait_s_;        // without a read-back, until PV shows it
  double pushed_ = 0.0;         // CO units
  double from_ = 0.0;           // CO units, stem before
  std::uint32_t followed_ = 0;  // values in a row in which the stem has followed
  std::uint32_t free_landings_ = 0;
  std::uint32_t moves_since_ = 0;
  double since_s_ = 0.0;
};

}  // namespace loopwarden::control
