// SPDX-License-Identifier: Apache-2.0
// Measures the cycles of a loop: variance of SP - PV, stem travel and period.
//
// A cycle ends when SP - PV has crossed both margins. A cycle counts if the set point left more
// than half of it undisturbed. No call allocates or throws.
#pragma once

#include <cstdint>

namespace loopwarden::control {

// The loop without planned moves.
struct LoopBaseline {
  double variance = 0.0;     // v0, of SP - PV without noise, PV units^2; 0: not known yet
  double travel_rate = 0.0;  // p0, of the stem, CO units/s
  double cycle_s = 0.0;      // mean period of a cycle
};

class CycleStatistics {
 public:
  explicit CycleStatistics(double period_s) noexcept : period_s_(period_s) {}

  // Forgets all complete cycles.
  void restart() noexcept;
  // One period. `margin`: PV units, SP - PV within it is no crossing. `counts`: the set point has
  // settled. `travel`: CO units, of the stem in this cycle. Returns true if a cycle has ended with
  // this call; the caller then resets the travel.
  bool add_error(double error, double margin, double travel) noexcept;
  void add_square(double error, bool counts) noexcept;

  bool cycle_has_just_ended() const noexcept { return running_.lasts_s <= period_s_; }
  double cycles() const noexcept { return cycles_; }
  double travel() const noexcept { return total_.travel; }  // CO units, of all cycles
  // Mean square of the cycles and its standard error, PV units^2.
  double mean_square() const noexcept { return mean_square_; }
  double standard_error() const noexcept;
  // `j`: CO units, the least travel per cycle. `least_variance`: PV units^2.
  LoopBaseline baseline(double noise_variance, double j, double least_variance) const noexcept;

 private:
  struct Sum {
    double squares = 0.0;  // PV units^2 s
    double lasts_s = 0.0;
    double counted_s = 0.0;  // of that, without what a change of the set point takes
    double travel = 0.0;     // CO units
  };
  void end_cycle(double travel) noexcept;

  double period_s_;
  int side_ = 0;             // of SP - PV: -1, 0 or 1
  std::uint32_t flips_ = 0;  // of the side
  Sum running_;
  Sum total_;
  double cycles_ = 0.0;
  double mean_square_ = 0.0;
  double spread_ = 0.0;  // sum of squared differences from it
};

}  // namespace loopwarden::control
