// SPDX-License-Identifier: Apache-2.0
// One physical effect in the signal path of the loop, and a chain of them.
//
// Each effect is a class in a file of its own with three functions:
//   double reset(double in) noexcept               steady state at this input; returns the output,
//                                                  what depends on time or chance left out
//   double step(double in [, double time_s]) noexcept   one period; returns the output
//   void set_severity(double severity) noexcept    0: absent, 1: as configured, between: partly
// To add one: write the file, add it to the list here, and describe it in effect_catalogue.cpp.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "model/plant/backlash.hpp"
#include "model/plant/cam_obstruction.hpp"
#include "model/plant/drift.hpp"
#include "model/plant/extra_dead_time.hpp"
#include "model/plant/first_order_lag.hpp"
#include "model/plant/gain_change.hpp"
#include "model/plant/hysteresis_offset.hpp"
#include "model/plant/hysteresis_width.hpp"
#include "model/plant/low_air_supply.hpp"
#include "model/plant/oscillating_disturbance.hpp"
#include "model/plant/output_bias.hpp"
#include "model/plant/positioner.hpp"
#include "model/plant/positioner_overshoot.hpp"
#include "model/plant/random_load.hpp"
#include "model/plant/step_disturbance.hpp"
#include "model/plant/stiction_choudhury.hpp"
#include "model/plant/stiction_he.hpp"
#include "model/plant/stiction_inertial.hpp"
#include "model/plant/stiction_karnopp.hpp"
#include "model/plant/valve_characteristic.hpp"

namespace loopwarden::plant {

using Effect = std::variant<Backlash, CamObstruction, Drift, ExtraDeadTime, FirstOrderLag,
                            GainChange, HysteresisOffset, HysteresisWidth, LowAirSupply,
                            OscillatingDisturbance, OutputBias, Positioner, PositionerOvershoot,
                            RandomLoad, StepDisturbance, StictionChoudhury, StictionHe,
                            StictionInertial, StictionKarnopp, ValveCharacteristic>;

// When an effect is present. Severity rises from 0 at `from_s` to 1 at `from_s + ramp_s`, and drops
// to 0 at `to_s`.
struct Schedule {
  double from_s = -std::numeric_limits<double>::infinity();  // s, time of the record
  double to_s = std::numeric_limits<double>::infinity();     // s
  double ramp_s = 0.0;                                       // s, >= 0

  friend bool operator==(const Schedule&, const Schedule&) = default;

  bool always() const noexcept { return *this == Schedule{}; }
  double severity(double time_s) const noexcept {
    if (time_s < from_s || time_s >= to_s) return 0.0;
    return ramp_s > 0.0 ? std::min(1.0, (time_s - from_s) / ramp_s) : 1.0;
  }
};

// Effects in the order in which the signal meets them.
class EffectChain {
 public:
  // Allocates; everything below does not.
  void add(Effect effect, const Schedule& schedule = {});

  double reset(double in, double time_s) noexcept;
  double step(double in, double time_s) noexcept;
  // The same; `before_characteristic` receives the signal as it enters the first valve
  // characteristic, or the output if there is none: the stem travel, where the chain is a valve's.
  double reset(double in, double time_s, double& before_characteristic) noexcept;
  double step(double in, double time_s, double& before_characteristic) noexcept;

  // Steps the whole of `signal`, sample k at `first_s` + k `period_s`, in place: the same bits as sample
  // by sample, several times as fast.
  void run(std::span<double> signal, double first_s, double period_s) noexcept;

  bool empty() const noexcept { return links_.empty(); }
  // Largest severity of the effects on a schedule, 0 if there is none.
  double scheduled_severity(double time_s) const noexcept;

 private:
  struct Link {
    Effect effect;
    Schedule schedule;
    bool scheduled;
    bool is_characteristic;
  };
  // `advance(effect, in)` gives the effect's output.
  template <class Advance>
  double pass(double in, double time_s, double& before_characteristic, Advance advance) noexcept;

  std::vector<Link> links_;
};

// Calls `f` with whichever effect is held. Unlike std::visit it has no way to throw.
template <class Variant, class F>
void with_effect(Variant& effect, F&& f) noexcept {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (void)((effect.index() == I ? (f(*std::get_if<I>(&effect)), true) : false) || ...);
  }
  (std::make_index_sequence<std::variant_size_v<std::remove_const_t<Variant>>>{});
}

}  // namespace loopwarden::plant
