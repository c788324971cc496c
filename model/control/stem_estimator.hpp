// SPDX-License-Identifier: Apache-2.0
// Estimates where the stem is: from the read-back, or by the law of stiction from CO.
//
// A read-back that a gateway holds counts once per new value. The renewal interval is the least
// time between two changes; a value that stays counts again after 1.5 intervals. A stem has moved
// when two values in a row are away from its position. No call allocates or throws.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "model/control/compensator_contract.hpp"
#include "model/control/valve_friction.hpp"

namespace loopwarden::control {

struct Stem {
  bool known = false;
  double position = 0.0;    // CO units, mean since it moved last
  double previous = 0.0;    // CO units, position before it moved last
  double standing_s = 0.0;  // since it moved last
  double travel = 0.0;      // CO units, since the last reset_travel()
  bool moved = false;       // in this period

  void move_to(double to) noexcept;
};

// A stem that follows CO by the law of stiction (Choudhury, Thornhill and Shah 2005).
class StictionStem {
 public:
  void step(double output, const ValveFriction& friction, double period_s) noexcept;
  // Continues from `stem`, with CO at `output`.
  void begin(const StictionStem& before, double output) noexcept;
  const Stem& stem() const noexcept { return stem_; }
  Stem& stem() noexcept { return stem_; }

 private:
  Stem stem_;
  double output_ = 0.0;     // CO units, of the period before
  double direction_ = 0.0;  // 0: stuck
};

// Finds the periods in which a read-back is renewed.
class ReadBackClock {
 public:
  // `renewal`: periods between two values until two changes were seen.
  explicit ReadBackClock(std::size_t renewal) noexcept : renewal_(renewal) {}
  // One period. Returns whether the value is new, or could have changed and did not.
  bool step(bool changed) noexcept;
  std::size_t renewal() const noexcept { return renewal_; }  // periods

 private:
  std::size_t renewal_;
  std::size_t since_renewal_ = 0;
  std::size_t since_change_ = 0;
  bool changed_before_ = false;
};

class StemEstimator {
 public:
  StemEstimator(const PlannedMovesSettings& settings, double period_s) noexcept;

  // One period. `learns`: slips that are read back improve `friction`.
  void step(const CompensatorInputs& in, bool learns, ValveFriction& friction) noexcept;
  void reset_travel() noexcept { model_.stem().travel = 0.0; }

  const Stem& stem() const noexcept { return model_.stem(); }
  const StictionStem& model() const noexcept { return model_; }
  double newest() const noexcept { return newest_; }  // CO units, read back
  bool renewed() const noexcept { return renewed_; }
  std::uint32_t lost_samples() const noexcept { return lost_; }  // in a row
  double sample_s() const noexcept { return static_cast<double>(clock_.renewal()) * period_s_; }
  // CO units from the position within which a read-back is no movement.
  double zone() const noexcept;

 private:
  void read(double position, double output, bool learns, ValveFriction& friction) noexcept;

  bool read_back_;
  double period_s_;
  double s_;  // CO units, as given
  double j_;
  StictionStem model_;
  ReadBackClock clock_;
  bool renewed_ = false;         // in this period
  double newest_ = 0.0;          // CO units
  double averaged_ = 0.0;        // samples in the position
  std::uint32_t away_ = 0;       // samples in a row away from the position
  double output_at_slip_ = 0.0;  // CO units, when the stem was first away
  double variance_;              // of the read-back's noise, CO units^2
  double least_step_ = std::numeric_limits<double>::infinity();  // CO units, of the read-back
  std::uint32_t lost_ = 0;                                       // samples without a read-back
};

}  // namespace loopwarden::control
